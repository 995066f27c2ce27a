"""`twbr tune BAG...`: time constants and filter parameters that fit your recordings."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ..configuration.files import date_of_now
from ..errors import ConfigurationError
from ..filters import filter_named
from ..many.places import recordings_at
from ..printing.console import SafeConsole
from ..tuning.filter import TunedFilter
from ..tuning.objective import Objective
from ..tuning.search import GLOBAL_PARAMETERS, tunable
from ..tuning.several import tune_unit
from ..tuning.tune import TuningRequest, TuningResult, tune, write_tuned
from ..workers import Workers
from .arguments import (
    add_comparison,
    add_recordings,
    add_settings,
    add_smoothing,
    comparison,
    topic_names,
)
from .main import INTERRUPTED
from .many import add_many, workers_of
from .progress_lines import Line, best_so_far, lines

DEFAULT_OUTPUT = "filters.yaml"


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "tune",
        description="Search the parameters with which the estimates agree best with the reference "
        "encoder: first the correction's time constants, then each filter's parameters. "
        "A directory stands for all recordings below it. Ctrl-C keeps the best so far.",
    )
    add_recordings(parser, many=True)
    parser.add_argument(
        "--verify",
        nargs="+",
        action="extend",
        default=[],
        metavar="BAG",
        help="other recordings, to judge the result on",
    )
    parser.add_argument(
        "--filter",
        action="append",
        default=[],
        metavar="NAME",
        help="filter to tune, repeatable; default: all",
    )
    parser.add_argument(
        "--objective",
        default="mse",
        metavar="mse[+delay[=W]][+roughness[=W]]",
        help="mean square error, with a price on lag [deg^2/ms^2] and on noise [s^2]; "
        "default: %(default)s",
    )
    parser.add_argument(
        "--keep-correction", action="store_true", help="leave the low-pass constants as configured"
    )
    parser.add_argument(
        "--thorough",
        action="store_true",
        help=f"search filters of more than {GLOBAL_PARAMETERS} parameters globally, too: minutes",
    )
    parser.add_argument(
        "--accept-contradictions",
        action="store_true",
        help="tune on recordings that fail their checks (`twbr check`), too",
    )
    add_smoothing(parser)
    add_settings(parser)
    add_comparison(parser)
    _add_run(parser)
    parser.set_defaults(run=run)


def _add_run(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path(DEFAULT_OUTPUT),
        metavar="FILE|DIR",
        help="parameter file to write, or the folder for it; default: %(default)s",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace an existing file")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the global search")
    add_many(parser)


def run(arguments: argparse.Namespace) -> int:
    """Tune, print what was found and write it."""
    console = SafeConsole(stderr=True)
    target = arguments.output
    target = target / DEFAULT_OUTPUT if target.is_dir() or not target.suffix else target
    # Known before the search, not after it.
    if target.exists() and not arguments.overwrite:
        raise ConfigurationError(f"{target}: exists already; --overwrite replaces it")
    request = _request(arguments)
    with (
        workers_of(arguments, module=tune_unit.__module__) as some,
        _remembering(arguments, request, some) as workers,
        lines(console) as line,
    ):
        result = tune(request, workers, partial(best_so_far, line), partial(_smoothed, line))
    _print(SafeConsole(), result)
    if target.exists():
        console.print(f"replacing {escape(str(target))}")
    write_tuned(target, result, _provenance(), replace=arguments.overwrite)
    console.print(f"{'interrupted; ' if result.interrupted else ''}wrote {escape(str(target))}")
    return INTERRUPTED if result.interrupted else 0


def _request(arguments: argparse.Namespace) -> TuningRequest:
    if arguments.seed < 0:
        raise ConfigurationError(f"--seed {arguments.seed}: is below 0")
    return TuningRequest(
        training=tuple(map(Path, recordings_at(arguments.bags))),
        verification=tuple(map(Path, recordings_at(arguments.verify))),
        names=tuple(arguments.filter),
        objective=Objective.parsed(arguments.objective),
        keep_correction=arguments.keep_correction,
        preset=arguments.preset,
        config=arguments.config,
        topics=topic_names(arguments),
        options=comparison(arguments),
        seed=arguments.seed,
        thorough=arguments.thorough,
        smooth=arguments.smooth,
        accept_contradictions=arguments.accept_contradictions,
    )


@contextmanager
def _remembering(
    arguments: argparse.Namespace, request: TuningRequest, workers: Workers
) -> Iterator[Workers]:
    """Give workers that tune no filter again that the table of results holds.

    Without `--results`, one recording is tuned again each time.
    """
    if arguments.results is None and len(request.training) == 1:
        yield workers
        return
    from ..many.remembering import Remembering
    from ..many.results import open_table

    with closing(open_table(arguments.results)) as table:
        yield Remembering(workers, table, "tune", asdict, TunedFilter.of)


def _smoothed(line: Line, source: str, share: float) -> None:
    line(source, f"smoothed to {100.0 * share:.0f} %")


def _provenance() -> dict[str, str]:
    command = shlex.join(["twbr", *sys.argv[1:]])
    return {"command": command, "date": date_of_now()}


def _print(console: Console, result: TuningResult) -> None:
    if (tuned := result.tuned_correction) is not None:
        console.print(
            f"Correction at {1e3 * result.dt:g} ms: "
            f"rate time constant {tuned.settings.rate_time_constant:.5f} s, "
            f"velocity time constant {tuned.settings.velocity_time_constant:.5f} s; "
            f"MSE of the angle {tuned.mse_before_deg2:.4g} -> {tuned.mse_after_deg2:.4g} deg²",
            highlight=False,
            soft_wrap=True,
        )
    console.print(_table(result))
    for each in result.filters:
        searched = tunable(filter_named(each.name))
        values = ", ".join(f"{name} {each.values[name]:.5g}" for name in searched)
        console.print(f"{each.name}: {values}", highlight=False, soft_wrap=True)
    warnings = list(result.warnings)
    warnings += _folded(text for each in result.filters for text in each.warnings)
    if not result.verification:
        warnings.append("nothing was verified; --verify takes other recordings")
    for warning in dict.fromkeys(warnings):
        console.print(f"warning: {escape(warning)}", highlight=False, soft_wrap=True)


def _folded(warnings: Iterable[str]) -> list[str]:
    """Return warnings that differ in the parameter's name only as one line."""
    owners: dict[str, list[str]] = {}
    for text in warnings:
        owner, colon, rest = text.partition(": ")
        owners.setdefault(rest if colon else text, []).append(owner if colon else "")
    return [f"{', '.join(names)}: {rest}" if any(names) else rest for rest, names in owners.items()]


def _table(result: TuningResult) -> Table:
    table = Table(title=f"tuned at {1e3 * result.dt:g} ms", title_justify="left")
    table.add_column("filter", no_wrap=True)
    for heading in ("training\nMSE [deg²]", "verification\nMSE [deg²]", "largest\nmodulus"):
        table.add_column(escape(heading), justify="right", no_wrap=True)
    for each in sorted(result.filters, key=lambda one: one.judged_mse_deg2):
        verified = each.verification_mse_deg2
        table.add_row(
            each.name + (" (interrupted)" if each.interrupted else ""),
            f"{each.training_mse_deg2:.4f}",
            "" if verified is None else f"{verified:.4f}",
            f"{each.eigenvalue_moduli[0]:.5f}" if each.eigenvalue_moduli else "",
        )
    return table
