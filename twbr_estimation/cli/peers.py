"""`twbr peers BAG...`: our filters beside estimators of other projects."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import Any

from rich.markup import escape
from rich.table import Table

from ..drives import load
from ..peers.comparison import BLIND, OURS, PEERS, Comparison, chosen, compare
from ..peers.table import COST, markdown
from ..printing.console import SafeConsole
from ..printing.text import say
from ..scoring.table import write_json
from .arguments import add_comparison, add_recordings, add_settings, comparison, topic_names


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "peers",
        description="Run estimators of other projects and filters of this one on the same "
        "corrected samples, compare them with the same reference, and measure what a sample costs. "
        "Peers see gyro and accelerometer; our filters run with wheels, and without. Peers: "
        f"{', '.join(peer.name for peer in PEERS)} (extra `peers`).",
    )
    add_recordings(parser)
    for flag, what, default in (("--peer", "peer, or its package", "all"), ("--filter", "filter of "
        "this package", ", ".join(OURS))):  # fmt: skip
        parser.add_argument(
            flag,
            action="append",
            default=[],
            metavar="NAME",
            help=f"{what}, repeatable; default: {default}",
        )
    add_settings(parser)
    add_comparison(parser)
    parser.add_argument("--json", metavar="FILE", help="also write the figures; - for stdout")
    parser.add_argument("--markdown", action="store_true", help="print one table for a page")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Compare, print the tables and write the JSON."""
    peers, ours = chosen(arguments.peer), tuple(arguments.filter) or OURS
    options, topics = comparison(arguments), topic_names(arguments)
    found: dict[str, Comparison] = {}
    for path in arguments.bags:
        drive = load(
            path,
            config=arguments.config,
            preset=arguments.preset,
            topics=topics,
            options=options,
            required=("reference",),
        )
        found[str(path)] = compare(drive, peers, ours)
    console = SafeConsole(stderr=arguments.json == "-")
    if arguments.markdown:
        say(markdown({path: [each] for path, each in found.items()}))
    else:
        for path, each in found.items():
            console.print(_table(path, each))
    for text in dict.fromkeys(text for each in found.values() for text in each.missing):
        console.print(f"left out: {escape(text)}", highlight=False, soft_wrap=True)
    if arguments.json is not None:
        write_json(arguments.json, _document(found))
    return 0


def _table(path: str, found: Comparison) -> Table:
    score = found.score
    table = Table(
        title=escape(f"{path}: {score.samples} samples at {1e3 * score.dt:g} ms"),
        title_justify="left",
    )
    table.add_column("estimator", no_wrap=True)
    for heading in ("MSE\n[deg²]", "bias\n[deg]", "max\n[deg]", COST.replace(" ", "\n", 1)):
        table.add_column(escape(heading), justify="right", no_wrap=True)
    ranked = sorted(score.estimators.items(), key=lambda item: item[1].mse_deg2)
    for name, each in ranked:
        cost = found.microseconds.get(name)
        own = name.removesuffix(BLIND) not in {peer.name for peer in PEERS}
        table.add_row(
            escape(name),
            f"{each.mse_deg2:.4f}",
            f"{each.bias_deg:+.3f}",
            f"{each.max_abs_deg:.2f}",
            "" if cost is None else f"{cost:.2f}",
            style="bold" if own else None,
        )
    return table


def _document(found: dict[str, Comparison]) -> dict[str, object]:
    return {
        "recordings": [
            {
                "path": path,
                "samples": each.score.samples,
                "estimators": {
                    name: {**asdict(score), "us_per_sample": each.microseconds.get(name)}
                    for name, score in each.score.estimators.items()
                },
                "missing": each.missing,
            }
            for path, each in found.items()
        ]
    }
