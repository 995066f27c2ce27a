"""Try for hours to break everything, and write what was seen into docs/reliability.md.

    python tools/campaign.py                      all parts at full size: many hours
    python tools/campaign.py messages devices     these parts
    python tools/campaign.py --scale 0.01         a hundredth of the tries
    python tools/campaign.py --list               what there is

Each part replaces its rows in docs/reliability.json, of which the page is made. The status is 1
where something fell short.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from importlib import import_module
from inspect import getdoc
from pathlib import Path
from types import ModuleType

from node_processes import unused_domain
from reliability.results import keep, load, page
from reliability.row import Effort, Row, Skipped

ROOT = Path(__file__).resolve().parent.parent
PARTS = Path(__file__).resolve().parent / "reliability" / "parts"
RESULTS = "reliability.json"
PAGE = "reliability.md"


def part_names() -> list[str]:
    """Return the names of all parts."""
    return sorted(path.stem for path in PARTS.glob("[a-z]*.py"))


def part_named(name: str) -> ModuleType:
    """Return the module of a part."""
    return import_module(f"reliability.parts.{name}")


def about(part: ModuleType) -> str:
    """Return the first line of a part's description."""
    return (getdoc(part) or part.__name__).splitlines()[0]


def run(name: str, effort: Effort) -> list[Row]:
    """Run a part; print each row as it comes.

    Raises:
        Skipped: it cannot run here.
    """
    rows = []
    for row in part_named(name).rows(effort):
        verdict = "held      " if row.held else "FELL SHORT"
        print(f"{verdict} {name}: {row.test}, {row.tries} tries: {row.seen}", flush=True)
        rows.append(row)
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the parts asked for; return 1 where something fell short."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help="default: all")
    parser.add_argument("--list", action="store_true", help="name the parts and stop")
    parser.add_argument("--scale", type=float, default=1.0, help="share of the full tries")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--hours", type=float, default=1.0, help="length of the long run")
    parser.add_argument("--docs", type=Path, default=ROOT / "docs", help="where page and JSON are")
    given = parser.parse_args(arguments)
    if unknown := set(given.parts) - set(part_names()):
        parser.error(f"no part {', '.join(sorted(unknown))}; there are: {', '.join(part_names())}")
    if given.list:
        for name in part_names():
            print(f"{name:12} {about(part_named(name))}")
        return 0
    os.environ |= {"ROS_DOMAIN_ID": str(unused_domain()), "TWBR_NO_BACKGROUND": "1"}
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    fell_short = False
    for name in given.parts or part_names():
        begin = time.monotonic()
        try:
            rows = run(name, Effort(given.scale, given.seed, given.hours))
        except Skipped as why:
            print(f"skipped    {name}: {why}")
            continue
        fell_short |= not all(row.held for row in rows)
        keep(given.docs / RESULTS, name, about(part_named(name)), rows)
        (given.docs / PAGE).write_text(page(load(given.docs / RESULTS)))
        print(f"{name}: {time.monotonic() - begin:.0f} s")
    return int(fell_short)


if __name__ == "__main__":
    sys.exit(main())
