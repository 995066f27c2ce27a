"""`twbr filters`: every filter with its parameters, units, bounds, defaults and source."""

from __future__ import annotations

import argparse
import json
from typing import Any

from rich.console import Console
from rich.table import Table

from ..filters import Filter, Parameter, filters


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser("filters", help="list the filters and their parameters")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the filters."""
    if arguments.json:
        print(json.dumps({"filters": [description(entry) for entry in filters().values()]}))
        return 0
    console = Console()
    for entry in filters().values():
        _print_filter(console, entry)
    return 0


def description(entry: Filter) -> dict[str, Any]:
    """Return a filter's definition as plain data."""
    return {
        "name": entry.name,
        "title": entry.title,
        "source": entry.source,
        "tuned_dt": entry.tuned_dt,
        "uses_wheels": entry.uses_wheels,
        "estimates_gyro_bias": entry.estimates_gyro_bias,
        "estimates_variance": entry.estimates_variance,
        "limits": dict(entry.limits),
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
    if entry.declared():
        console.print(_table(entry.declared()))
    console.print()


def _table(parameters: tuple[Parameter, ...]) -> Table:
    table = Table(box=None, padding=(0, 2))
    for heading in ("parameter", "default", "range", "unit"):
        table.add_column(heading, no_wrap=True)
    table.add_column("meaning")
    for parameter in parameters:
        bounds = parameter.bounds
        table.add_row(
            parameter.name,
            f"{parameter.default:g}",
            f"{bounds.minimum:g} to {bounds.maximum:g}",
            bounds.unit,
            bounds.description,
        )
    return table
