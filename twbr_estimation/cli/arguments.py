"""Arguments that several verbs share."""

from __future__ import annotations

import argparse
import math
import re
from pathlib import Path

from rich.console import Console

from ..bags import TopicNames
from ..bags.topics import ROLES
from ..batch.precompile import compile_later
from ..configuration.of_recording import TERMS
from ..drives.drive import chosen, require_period
from ..drives.request import RunRequest
from ..errors import ConfigurationError
from ..samples import Stamps
from ..scoring.estimator_topics import FORM
from ..scoring.score import ScoringOptions

FLAGS = {
    "names": "--filter",
    "values": "--set",
    "estimators": "--estimator",
    "config": "--config",
    "preset": "--preset",
    "terms": "--terms",
    "loop_period": "--loop-period",
    "overwrite": "--overwrite",
    "columns": "--columns",
    "axis": "--axis",
    "smooth": "--smooth",
    "turns": "--turns",
    "accept_contradictions": "--accept-contradictions",
    **{name: f"--{name}" for name in ("dt", "duration", "scene", "seed")},
    **{f"topics.{role}": f"--{role.replace('_', '-')}-topic" for role in ROLES},
    "topics.wheel_joints": "--wheel-joints",
    "topics.reference_joint": "--reference-joint",
    "topics.stamps": "--stamps",
}
"""The flag that sets each argument of the library; its errors name arguments in backticks."""


def in_flags(message: str) -> str:
    """Return an error message of the library with the flags in place of its arguments."""
    return re.sub(r"`([\w.]+)`", lambda found: FLAGS.get(found[1], found[0]), message)


def add_recordings(
    parser: argparse.ArgumentParser, count: int | str = "+", many: bool = False
) -> None:
    """Add `count` recordings (one or more) and the names of their topics and joints.

    With `many` they stay text, for `many.places.recordings_at`.
    """
    parser.add_argument(
        "bags",
        nargs=count,
        type=str if many else Path,
        metavar="BAG",
        help="recordings, folders that hold some, patterns such as 'runs/**/*.mcap', or addresses "
        "that fsspec opens (`tune` takes none)"
        if many
        else "recordings",
    )
    group = parser.add_argument_group("names in the recordings")
    defaults = TopicNames()
    for role in ROLES:
        default = getattr(defaults, role)
        group.add_argument(
            FLAGS[f"topics.{role}"],
            dest=role,
            metavar="TOPIC",
            default=default,
            help=f"default: {default}",
        )
    group.add_argument(
        "--wheel-joints",
        metavar="JOINT[,JOINT]",
        default=",".join(defaults.wheel_joints),
        help="one joint, or left,right; default: %(default)s",
    )
    group.add_argument(
        "--reference-joint",
        metavar="JOINT",
        default=defaults.reference_joint,
        help="default: %(default)s",
    )
    group.add_argument(
        FLAGS["topics.stamps"],
        choices=[each.value for each in Stamps],
        default=defaults.stamps.value,
        help="clock of IMU and wheels: the header's, that of the recorder, or the device's own, "
        "related to the recorder's; default: %(default)s",
    )


def topic_names(arguments: argparse.Namespace) -> TopicNames:
    """Return the topic and joint names given on the command line."""
    return TopicNames(
        **{role: getattr(arguments, role) for role in ROLES},
        wheel_joints=tuple(arguments.wheel_joints.split(",")),
        reference_joint=arguments.reference_joint,
        stamps=Stamps(arguments.stamps),
    )


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Add where robot, calibration and filter settings come from."""
    group = parser.add_argument_group("settings")
    group.add_argument("--preset", metavar="NAME", help="settings that ship with the package")
    group.add_argument(
        "--config",
        type=Path,
        metavar="DIR",
        help="folder with robot.yaml, calibration.yaml, filters.yaml; files it lacks, by default "
        "all, come from the folder `config` inside the recording",
    )


def add_request(parser: argparse.ArgumentParser, many: bool = False, default: str = "all") -> None:
    """Add recordings, filters, settings and comparison: all that `request_of` reads.

    `default` says in the help which filters run where none is named.
    """
    add_recordings(parser, many=many)
    parser.add_argument(
        "--filter",
        action="append",
        default=[],
        metavar="NAME",
        help=f"filter to run, repeatable; default: {default}",
    )
    parser.add_argument(
        "--estimator",
        action="append",
        default=[],
        metavar="NAME=TOPIC",
        help="further estimator in the recording (orientation of an Imu, Float64, or JointState "
        f"as TOPIC:JOINT), repeatable; in full: NAME={FORM}",
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
    parser.add_argument(
        "--loop-period",
        type=float,
        default=0.0,
        metavar="S",
        help="combine the samples of S seconds for a slower loop; default: take each",
    )
    add_smoothing(parser)
    add_comparison(parser)


def add_smoothing(parser: argparse.ArgumentParser) -> None:
    """Add that recordings are smoothed."""
    parser.add_argument(
        "--smooth",
        action="store_true",
        help="make a reference from the whole recording, with hindsight, where it has none",
    )


def request_of(arguments: argparse.Namespace) -> RunRequest:
    """Return the request that the arguments of `add_request` describe.

    Raises:
        ConfigurationError: an argument that cannot be used.
    """
    terms = None
    if arguments.terms is not None:
        terms = tuple(name for name in arguments.terms.split(",") if name not in ("", "none"))
        for name in terms:
            if name not in TERMS:
                raise ConfigurationError(f"--terms {name}: there are {', '.join(TERMS)}, none")
    require_period(arguments.loop_period)
    return RunRequest(
        names=tuple(entry.name for entry in chosen(arguments.filter)),
        values=parameter_values(arguments.set),
        preset=arguments.preset,
        config=arguments.config,
        terms=terms,
        topics=topic_names(arguments),
        estimators=named_topics(arguments.estimator),
        options=comparison(arguments),
        loop_period=arguments.loop_period,
        smooth=arguments.smooth,
    )


def finish_compiling(request: RunRequest, console: Console) -> None:
    """Compile the loops that ran interpreted for the next time, with a message."""
    if compile_later(chosen(request.names)):
        console.print("the filters are compiled in the background for the next run", style="dim")


def add_comparison(parser: argparse.ArgumentParser) -> None:
    """Add how estimates are compared with the reference."""
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


def comparison(arguments: argparse.Namespace) -> ScoringOptions:
    """Return how estimates are compared with the reference.

    Raises:
        ConfigurationError: a value that is not finite, or a negative time to skip.
    """
    for flag in ("reference_delay", "reference_offset", "skip"):
        if not math.isfinite(getattr(arguments, flag)):
            raise ConfigurationError(f"--{flag.replace('_', '-')}: must be a finite number")
    if arguments.skip < 0.0:
        raise ConfigurationError(f"--skip {arguments.skip:g}: must be 0 s or more")
    return ScoringOptions(
        arguments.reference_delay, math.radians(arguments.reference_offset), arguments.skip
    )


def named_topics(pairs: list[str]) -> dict[str, str]:
    """Return NAME=TOPIC arguments as topics by name.

    Raises:
        ConfigurationError: an argument without a name or a topic, or a name given twice.
    """
    named: dict[str, str] = {}
    for pair in pairs:
        name, topic = _split(pair, "--estimator", "NAME=TOPIC")
        if name in named:
            raise ConfigurationError(f"--estimator {pair}: {name} is {named[name]} already")
        named[name] = topic
    return named


def parameter_values(pairs: list[str]) -> dict[str, dict[str, float]]:
    """Return FILTER.PARAMETER=VALUE arguments as values by filter and parameter.

    Raises:
        ConfigurationError: an argument of another form, or a value that is no number.
    """
    values: dict[str, dict[str, float]] = {}
    for pair in pairs:
        key, text = _split(pair, "--set", "FILTER.PARAMETER=VALUE")
        owner, dot, name = key.partition(".")
        try:
            number = float(text)
        except ValueError:
            dot = ""
        if not dot:
            raise ConfigurationError(f"--set {pair}: expected FILTER.PARAMETER=VALUE")
        values.setdefault(owner, {})[name] = number
    return values


def _split(pair: str, flag: str, form: str) -> tuple[str, str]:
    left, equals, right = pair.partition("=")
    if not (left and equals and right):
        raise ConfigurationError(f"{flag} {pair}: expected {form}")
    return left, right
