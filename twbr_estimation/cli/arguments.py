"""Arguments that several verbs share."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..bags import TopicNames
from ..bags.topics import ROLES
from ..errors import ConfigurationError


def add_recordings(parser: argparse.ArgumentParser) -> None:
    """Add the recordings themselves and the names of their topics and joints."""
    parser.add_argument("bags", nargs="+", type=Path, metavar="BAG", help="recordings")
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


def named_topics(pairs: list[str]) -> dict[str, str]:
    """Return NAME=TOPIC arguments as topics by name.

    Raises:
        ConfigurationError: an argument without a name or a topic.
    """
    return dict(_split(pair, "--estimator", "NAME=TOPIC") for pair in pairs)


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
