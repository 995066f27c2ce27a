"""Arguments that several verbs share."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from ..bags import TopicNames
from ..bags.topics import ROLES
from ..configuration.of_recording import TERMS
from ..errors import ConfigurationError
from ..evaluate import Request
from ..samples import RESTART_GAP
from ..scoring.errors import Options
from ..scoring.estimator_topics import FORM


def add_recordings(parser: argparse.ArgumentParser, count: int | str = "+") -> None:
    """Add `count` recordings (one or more) and the names of their topics and joints."""
    parser.add_argument("bags", nargs=count, type=Path, metavar="BAG", help="recordings")
    group = parser.add_argument_group("names in the recordings")
    defaults = TopicNames()
    for role, flag in ROLES.items():
        default = getattr(defaults, role)
        group.add_argument(
            flag, dest=role, metavar="TOPIC", default=default, help=f"default: {default}"
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


def topic_names(arguments: argparse.Namespace) -> TopicNames:
    """Return the topic and joint names given on the command line."""
    return TopicNames(
        **{role: getattr(arguments, role) for role in ROLES},
        wheel_joints=tuple(arguments.wheel_joints.split(",")),
        reference_joint=arguments.reference_joint,
    )


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Add where robot, calibration and filter settings come from."""
    group = parser.add_argument_group("settings")
    group.add_argument("--preset", metavar="NAME", help="settings that ship with the package")
    group.add_argument(
        "--config",
        type=Path,
        metavar="DIR",
        help="folder with robot.yaml, calibration.yaml, filters.yaml; "
        "default: the folder `config` inside the recording, where there is one",
    )


def add_request(parser: argparse.ArgumentParser) -> None:
    """Add recordings, filters, settings and comparison: all that `request_of` reads."""
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


def request_of(arguments: argparse.Namespace) -> Request:
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
    return Request(
        names=tuple(arguments.filter),
        preset=arguments.preset,
        config=arguments.config,
        values=parameter_values(arguments.set),
        terms=terms,
        topics=topic_names(arguments),
        estimators=named_topics(arguments.estimator),
        options=comparison(arguments),
        loop_period=_loop_period(arguments.loop_period),
        smooth=arguments.smooth,
    )


def _loop_period(period: float) -> float:
    if not 0.0 <= period <= RESTART_GAP:
        raise ConfigurationError(f"--loop-period: {period:g} s is not within 0 to {RESTART_GAP:g}")
    return period


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


def comparison(arguments: argparse.Namespace) -> Options:
    """Return how estimates are compared with the reference.

    Raises:
        ConfigurationError: a value that is not finite, or a negative time to skip.
    """
    for flag in ("reference_delay", "reference_offset", "skip"):
        if not math.isfinite(getattr(arguments, flag)):
            raise ConfigurationError(f"--{flag.replace('_', '-')}: must be a finite number")
    if arguments.skip < 0.0:
        raise ConfigurationError(f"--skip {arguments.skip:g}: must be 0 s or more")
    return Options(
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
