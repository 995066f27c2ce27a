"""`twbr filters`: every filter with its parameters, units, bounds, defaults and source."""

from __future__ import annotations

import argparse
import inspect
import json
import sys
from collections.abc import Iterable, Iterator
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table

from ..filters import Filter, Parameter, filter_named, filters, listed_filters
from ..printing.console import SafeConsole
from ..printing.text import say


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "filters",
    )
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="print JSON instead of a table")
    parser.add_argument("names", nargs="*", metavar="NAME", help="filters to show in full")
    form.add_argument("--markdown", action="store_true", help="print the page docs/filters.md")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the filters."""
    if arguments.json:
        say(json.dumps({"filters": [description(entry) for entry in filters().values()]}))
        return 0
    if arguments.markdown:
        say(markdown_page(), end="")
        return 0
    console = SafeConsole()
    if not arguments.names:
        console.print(_list())
        console.print("twbr filters NAME... shows parameters; all shows those of every filter")
        return 0
    everything = "all" in arguments.names
    names = listed_filters() if everything else dict.fromkeys(arguments.names)
    for entry in [filter_named(name) for name in names]:
        _print_filter(console, entry)
    return 0


def _list() -> Table:
    table = Table(box=None, padding=(0, 1))
    table.add_column("filter", no_wrap=True)
    table.add_column("period", no_wrap=True, justify="right")
    table.add_column("what it is", ratio=1)
    for entry in listed_filters().values():
        period = "any" if entry.tuned_dt is None else f"{1e3 * entry.tuned_dt:g} ms"
        table.add_row(entry.name, period, f"{entry.title} {entry.source}")
    return table


def description(entry: Filter) -> dict[str, Any]:
    """Return a filter's definition as plain data."""
    return {
        "name": entry.name,
        "title": entry.title,
        "source": entry.source,
        "tuned_dt": entry.tuned_dt,
        "uses_wheels": entry.uses_wheels,
        "uses_motors": entry.uses_motors,
        "estimates_gyro_bias": entry.estimates_gyro_bias,
        "estimates_variance": entry.estimates_variance,
        "limits": dict(entry.limits),
        "historical": entry.historical,
        "parameters": [_parameter(parameter) for parameter in entry.declared()],
    }


def _parameter(parameter: Parameter) -> dict[str, Any]:
    bounds = parameter.bounds
    return {
        "name": parameter.name,
        "unit": bounds.unit,
        "default": parameter.default,
        "minimum": bounds.minimum,
        "maximum": bounds.maximum,
        "description": bounds.description,
    }


def _print_filter(console: Console, entry: Filter) -> None:
    console.print(f"[bold]{entry.name}[/bold]: {entry.title} {entry.source}", highlight=False)
    if entry.tuned_dt is not None:
        console.print(f"  defaults tuned at {entry.tuned_dt:g} s", highlight=False)
    for parameter in entry.declared():
        bounds = parameter.bounds
        limits = f"{bounds.minimum:g} to {bounds.maximum:g}"
        value = f"{parameter.default:g} [{bounds.unit}], {limits}"
        console.print(Padding(f"{parameter.name} = {escape(value)}", (0, 0, 0, 2)), highlight=False)
        console.print(Padding(escape(bounds.description), (0, 0, 0, 6)), highlight=False)
    console.print()


def markdown_page() -> str:
    """Return the page `docs/filters.md`."""
    return "\n".join(_page_lines()) + "\n"


def _page_lines() -> Iterator[str]:
    yield "# Filters"
    yield ""
    yield "Written by `twbr filters --markdown` from the filters themselves; do not edit."
    yield "Gains belong to the period named beside them; the preset `table2` has those of others."
    yield ""
    yield from _overview(listed_filters().values())
    yield ""
    yield "Historical ones are there by name, to reproduce a paper. They are not part of `all`, and"
    yield "nodes do not declare their parameters."
    yield ""
    yield from _overview(entry for entry in filters().values() if entry.historical)
    for entry in filters().values():
        yield from _section_lines(entry)


def _overview(entries: Iterable[Filter]) -> Iterator[str]:
    yield "| filter | what it is | source | gyro bias | variance | period |"
    yield "|---|---|---|---|---|---|"
    for entry in entries:
        cells = (
            f"[`{entry.name}`](#{entry.name})",
            entry.title.rstrip("."),
            entry.source,
            "yes" if entry.estimates_gyro_bias else "",
            "yes" if entry.estimates_variance else "",
            "any" if entry.tuned_dt is None else f"{1000 * entry.tuned_dt:g} ms",
        )
        yield f"| {' | '.join(cells)} |"


def _section_lines(entry: Filter) -> Iterator[str]:
    yield from ("", f"## {entry.name}", "")
    yield inspect.getdoc(sys.modules[entry.step.__module__]) or entry.title
    if entry.declared():
        yield ""
        yield "| parameter | default | range | unit | meaning |"
        yield "|---|---|---|---|---|"
    for name, default, bounds in ((p.name, p.default, p.bounds) for p in entry.declared()):
        limits = f"{bounds.minimum:g} to {bounds.maximum:g}"
        yield f"| `{name}` | {default:g} | {limits} | {bounds.unit} | {bounds.description} |"
    for clause, reason in entry.limits.items():
        yield from ("", f"Limit, {clause.replace('_', ' ')}: {reason}.")
