"""`twbr balance`: which estimator and which controller keep the simulated robot upright."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.progress import Progress
from rich.table import Table

from ..closed_loop.trial import TRUTH, Trial
from ..closed_loop.trials import Standings, as_json, run_all, standings
from ..configuration.files import read_correction, read_settings
from ..configuration.filter_settings import Settings
from ..configuration.presets import preset
from ..controllers import controller_named, controllers, listed_controllers
from ..errors import ConfigurationError
from ..filters import filter_named, filters, listed_filters
from ..physics.performance import scene_named
from ..printing.console import SafeConsole
from ..robot import CorrectionSettings
from ..scoring.table import write_json
from ..simulation.worlds import WORLDS, world_named
from ..streams.control.balance import DEFAULT_CONTROLLER
from .arguments import add_settings, parameter_values

ALL = "all"
LARGEST_FACTOR = 10.0
"""Of the pushes."""
_COLUMNS = (
    ("up\n[%]", "upright", 100.0, "{:.1f}"),
    ("falls", "falls", 1.0, "{:.1f}"),
    ("tilt\n[deg]", "rms_tilt", math.degrees(1.0), "{:.2f}"),
    ("error\n[deg]", "rms_error", math.degrees(1.0), "{:.2f}"),
    ("effort\n[V]", "effort", 1.0, "{:.2f}"),
    ("away\n[m]", "rms_position", 1.0, "{:.2f}"),
)


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "balance",
        description="Close the loop on the simulated robot, offline and in lockstep: every "
        f"estimator with every controller in every world. The estimator `{TRUTH}` is the true "
        "tilt, for comparison.",
    )
    for flag, known, default in (
        ("--world", tuple(WORLDS), "paper"),
        ("--estimator", (TRUTH, *listed_filters()), ALL),
        ("--controller", tuple(listed_controllers()), DEFAULT_CONTROLLER),
    ):
        parser.add_argument(
            flag,
            action="append",
            default=[],
            metavar="NAME",
            help=f"{', '.join(known)} or {ALL}; repeatable; default: {default}",
        )
    parser.add_argument(
        "--seeds", type=int, default=5, metavar="N", help="draws to average over; default: 5"
    )
    parser.add_argument(
        "--first-seed", type=int, default=1, metavar="N", help="the first of them; default: 1"
    )
    parser.add_argument(
        "--duration", type=float, default=60.0, metavar="SECONDS", help="default: %(default)s"
    )
    parser.add_argument(
        "--dt",
        type=float,
        default=0.005,
        metavar="SECONDS",
        help="sampling period of the IMU; the controller runs at 200 Hz; default: %(default)s",
    )
    parser.add_argument(
        "--pushes",
        type=float,
        default=1.0,
        metavar="FACTOR",
        help="factor on the world's pushes; default: %(default)s",
    )
    parser.add_argument(
        "--physics",
        choices=("rig", "mujoco"),
        default="rig",
        help="what moves the robot; in mujoco (extra `physics`) a scene stands for the world's "
        "ground and pushes; default: rig",
    )
    parser.add_argument(
        "--scene",
        metavar="NAME",
        help="in mujoco: what happens to the robot, a scene of twbr simulate; default: pushes",
    )
    parser.add_argument("--jobs", type=int, metavar="N", help="processes; default: one a core")
    add_settings(parser)
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME.PARAMETER=VALUE",
        help="change one parameter of a filter or a controller, repeatable",
    )
    parser.add_argument("--json", metavar="FILE", help="also write the figures; - for stdout")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run all trials, print the table and write the JSON."""
    trials, source = trials_of(arguments)
    console = SafeConsole(stderr=True)
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("balancing (the first run compiles)", total=len(trials))
        outcomes = run_all(
            trials, lambda done: progress.update(task, completed=done), arguments.jobs
        )
    output = SafeConsole(stderr=arguments.json == "-")
    for table in _tables(standings(trials, outcomes), trials[0].duration, source):
        output.print(table)
    if arguments.json is not None:
        write_json(arguments.json, as_json(trials, outcomes, source))
    return 0


def trials_of(arguments: argparse.Namespace) -> tuple[list[Trial], str]:
    """Return the trials of the command line, and the origin of their settings.

    Raises:
        ConfigurationError: an unknown name, or a number that cannot be used.
    """
    worlds = _chosen(arguments.world, tuple(WORLDS), "paper")
    estimators = _chosen(arguments.estimator, (TRUTH, *listed_filters()), ALL)
    names = _chosen(arguments.controller, tuple(listed_controllers()), DEFAULT_CONTROLLER)
    for world in worlds:
        world_named(world)
    for name in estimators:
        if name != TRUTH:
            filter_named(name)
    if arguments.seeds < 1 or arguments.first_seed < 0:
        raise ConfigurationError(
            f"--seeds {arguments.seeds}, --first-seed {arguments.first_seed}: "
            "at least one seed, from 0 on"
        )
    if arguments.jobs is not None and arguments.jobs < 1:
        raise ConfigurationError(f"--jobs {arguments.jobs} is below 1")
    if not 0.0 <= arguments.pushes <= LARGEST_FACTOR:
        raise ConfigurationError(
            f"--pushes {arguments.pushes:g} is not within 0 to {LARGEST_FACTOR:g}"
        )
    scene = _scene(arguments)
    correction, settings = _settings(arguments)
    changed = parameter_values(arguments.set)
    values = {
        name: {**settings.values.get(name, {}), **changed.get(name, {})} for name in filters()
    }
    for name in changed:
        known = controller_named(name) if name in controllers() else filter_named(name)
        known.configure(changed[name])
    trials = [
        Trial(
            world,
            estimator,
            name,
            seed,
            arguments.duration,
            arguments.dt,
            arguments.pushes,
            {estimator: values[estimator]} if estimator != TRUTH else {},
            correction,
            {name: changed.get(name, {})},
            scene,
        )
        for world in worlds
        for name in (controller_named(each).name for each in names)
        for estimator in estimators
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    ]
    return trials, settings.source


def _scene(arguments: argparse.Namespace) -> str | None:
    """Return the scene in MuJoCo; None for the rig."""
    if arguments.physics == "rig":
        if arguments.scene is not None:
            raise ConfigurationError("--scene: needs --physics mujoco")
        return None
    if arguments.pushes != 1.0:
        raise ConfigurationError("--pushes: is for the rig; in mujoco the scene pushes")
    name = arguments.scene or "pushes"
    scene_named(name)
    return name


def _chosen(given: Sequence[str], known: tuple[str, ...], default: str) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(given)) or (default,)
    return known if ALL in names else names


def _settings(arguments: argparse.Namespace) -> tuple[CorrectionSettings | None, Settings]:
    """Return correction and filter settings of a preset, a folder, or the defaults."""
    if arguments.preset is not None:
        return preset(arguments.preset, arguments.dt)
    if arguments.config is not None:
        if not arguments.config.is_dir():
            raise ConfigurationError(f"{arguments.config}: there is no such configuration folder")
        return read_correction(arguments.config), read_settings(arguments.config)
    return None, Settings()


def _tables(found: Sequence[Standings], duration: float, source: str) -> list[Table]:
    """Return one table for each world and controller, the best estimator first."""
    tables: dict[tuple[str, str], list[Standings]] = {}
    for entry in found:
        tables.setdefault((entry.world, entry.controller), []).append(entry)
    return [
        _table(f"world {world}, controller {controller}", entries, duration, source)
        for (world, controller), entries in tables.items()
    ]


def _table(title: str, entries: Sequence[Standings], duration: float, source: str) -> Table:
    seeds = entries[0].seeds
    table = Table(
        title=escape(f"{title}: mean over {seeds} runs of {duration:g} s; {source}"),
        title_justify="left",
        box=SIMPLE_HEAD,
        pad_edge=False,
        collapse_padding=True,
    )
    table.add_column("estimator", no_wrap=True)
    table.add_column("no\nfall", justify="right", no_wrap=True)
    for heading, *_ in _COLUMNS:
        table.add_column(escape(heading), justify="right", no_wrap=True)
    for entry in sorted(entries, key=lambda each: (-each.mean["upright"], each.mean["rms_tilt"])):
        cells = [form.format(scale * entry.mean[name]) for _, name, scale, form in _COLUMNS]
        table.add_row(escape(entry.estimator), f"{entry.stood}/{entry.seeds}", *cells)
    return table
