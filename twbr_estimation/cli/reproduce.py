"""`twbr reproduce table2`: the papers' tables and figures on simulated robots."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ..disk.writing import write_text
from ..errors import ConfigurationError
from ..printing.console import SafeConsole
from ..reproduction import DRAWN, PARTS, Plan, reproduce
from ..reproduction.page import PrintedTable, markdown, tables
from ..scoring.table import write_json
from ..simulation import WORLDS, world_named
from .many import add_workers, workers_of
from .progress_lines import shown


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "reproduce",
        description="Do the experiments of Laddach 2022, those on the stand of Chudzik 2021 and "
        "the spins of Sihite 2018 again in simulation: ours beside the printed figures. Nothing "
        "is tuned on the drives that are reported.",
    )
    parser.add_argument(
        "parts",
        nargs="+",
        choices=(*PARTS, "all"),
        metavar="PART",
        help=f"{', '.join(PARTS)}, or all; causes: why figures differ, stand: Figs 6 to 10 of "
        "Chudzik 2021, in a separate world",
    )
    parser.add_argument(
        "--seeds", type=int, default=5, metavar="N", help="drives to report; default: %(default)s"
    )
    parser.add_argument("--world", choices=tuple(WORLDS), default="paper", help="default: paper")
    parser.add_argument("--json", metavar="FILE", help="also write the figures; - for stdout")
    parser.add_argument(
        "--markdown", type=Path, metavar="FILE", help="also write the page of `all`"
    )
    parser.add_argument(
        "--plot",
        type=Path,
        metavar="FILE",
        help=f"draw {' or '.join(DRAWN)} as PNG; for both, the part's name is put into FILE",
    )
    add_workers(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Do the experiments, print tables and write files."""
    parts = PARTS if "all" in arguments.parts else tuple(dict.fromkeys(arguments.parts))
    if arguments.markdown is not None and set(parts) != set(PARTS):
        raise ConfigurationError("--markdown: the page needs all parts")
    plan = Plan(arguments.seeds, world_named(arguments.world))
    with workers_of(arguments) as workers, shown(SafeConsole(stderr=True)) as report:
        document = reproduce(
            parts,
            plan,
            workers,
            lambda name, best, _: report(name, best),
            _pictures(parts, arguments.plot),
        )
    quiet = arguments.json == "-"
    _print(SafeConsole(stderr=quiet), tables(document))
    if arguments.json is not None:
        write_json(arguments.json, document)
    if arguments.markdown is not None:
        _write(str(arguments.markdown), markdown(document))
    return 0


def _pictures(parts: Sequence[str], path: Path | None) -> dict[str, Path]:
    """Return the file of each part that is drawn."""
    drawn = [part for part in parts if part in DRAWN]
    if path is None:
        return {}
    if not drawn:
        raise ConfigurationError(f"--plot: nothing to draw; there are: {', '.join(DRAWN)}")
    if len(drawn) == 1:
        return {drawn[0]: path}
    return {part: path.with_stem(f"{path.stem}_{part}") for part in drawn}


def _print(console: Console, found: Sequence[PrintedTable]) -> None:
    for each in found:
        if _width(each) <= console.width:
            console.print(_columns(each))
        else:
            _print_lines(console, each)


def _width(printed: PrintedTable) -> int:
    """Return the width of a table in which no cell is broken."""
    rows = [printed.headings, *printed.rows]
    return 1 + sum(3 + max(map(len, column)) for column in zip(*rows, strict=True))


def _columns(printed: PrintedTable) -> Table:
    table = Table(title=escape(printed.title), title_justify="left")
    for heading in printed.headings:
        table.add_column(escape(heading), no_wrap=True)
    for row in printed.rows:
        table.add_row(*map(escape, row))
    return table


def _print_lines(console: Console, printed: PrintedTable) -> None:
    """Print a table that is too wide: a row as one name and its figures, a line each."""
    console.print(escape(printed.title), style="italic", soft_wrap=True)
    longest = max(map(len, printed.headings[1:]))
    for row in printed.rows:
        console.print(escape(row[0]), style="bold", highlight=False, soft_wrap=True)
        for heading, cell in zip(printed.headings[1:], row[1:], strict=True):
            if cell:
                text = escape(f"  {heading:{longest}}  {cell}")
                console.print(text, highlight=False, soft_wrap=True)


def _write(target: str, text: str) -> None:
    if target == "-":
        sys.stdout.write(text)
        return
    write_text(Path(target), text)
