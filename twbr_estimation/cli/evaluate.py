"""`twbr evaluate BAG...`: every filter's error against the reference encoder, as a table."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress

from ..errors import ConfigurationError
from ..evaluation import Options, RecordingScore
from ..offline import TERMS, Request, evaluate
from ..scores import print_scores, write_scores
from .arguments import (
    add_recordings,
    add_settings,
    named_topics,
    parameter_values,
    topic_names,
)


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "evaluate",
        help="errors of every filter against the reference encoder",
        description="Run filters on recordings and compare them with the reference encoder.",
    )
    add_recordings(parser)
    parser.add_argument(
        "--filter",
        action="append",
        default=[],
        metavar="NAME",
        help="filter to run, repeatable; default: all",
    )
    parser.add_argument(
        "--estimator",
        action="append",
        default=[],
        metavar="NAME=TOPIC",
        help="further estimator in the recording (Imu orientation or Float64 tilt), repeatable",
    )
    add_settings(parser)
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="FILTER.PARAMETER=VALUE",
        help="change one parameter, repeatable",
    )
    parser.add_argument(
        "--terms",
        metavar="TERM[,TERM]",
        help=f"motion terms to remove: some of {', '.join(TERMS)}, or none; default: as configured",
    )
    _add_comparison(parser)
    parser.add_argument("--json", metavar="FILE", help="also write the figures; - for stdout")
    parser.set_defaults(run=run)


def _add_comparison(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("comparison")
    group.add_argument(
        "--reference-delay",
        type=float,
        default=0.0,
        metavar="S",
        help="compare the estimate stamped t with the reference at t - S",
    )
    group.add_argument(
        "--reference-offset",
        type=float,
        default=0.0,
        metavar="DEG",
        help="added to the reference",
    )
    group.add_argument(
        "--skip", type=float, default=0.0, metavar="S", help="do not score the first S seconds"
    )


def request_of(arguments: argparse.Namespace) -> Request:
    """Return the request that the arguments describe.

    Raises:
        ConfigurationError: an argument that cannot be used.
    """
    terms = None
    if arguments.terms is not None:
        terms = tuple(name for name in arguments.terms.split(",") if name not in ("", "none"))
        for name in terms:
            if name not in TERMS:
                raise ConfigurationError(f"--terms {name}: there are {', '.join(TERMS)}, none")
    for flag in ("reference_delay", "reference_offset", "skip"):
        if not math.isfinite(getattr(arguments, flag)):
            raise ConfigurationError(f"--{flag.replace('_', '-')}: must be a finite number")
    return Request(
        names=tuple(arguments.filter),
        preset=arguments.preset,
        config=arguments.config,
        values=parameter_values(arguments.set),
        terms=terms,
        topics=topic_names(arguments),
        estimators=named_topics(arguments.estimator),
        options=Options(
            arguments.reference_delay,
            math.radians(arguments.reference_offset),
            arguments.skip,
        ),
    )


def run(arguments: argparse.Namespace) -> int:
    """Evaluate, print the tables and write the JSON."""
    request = request_of(arguments)
    scores = _evaluated(arguments.bags, request)
    quiet = arguments.json == "-"
    console = Console(stderr=quiet)
    print_scores(console, scores)
    if arguments.json is not None:
        write_scores(arguments.json, scores)
    return 0


def _evaluated(bags: Sequence[Path], request: Request) -> list[RecordingScore]:
    scores = []
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("evaluating", total=len(bags))
        for bag in bags:
            progress.update(task, description=f"evaluating {escape(str(bag))}")
            scores.append(evaluate(bag, request))
            progress.advance(task)
    return scores
