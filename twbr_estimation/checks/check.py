"""All checks of one recording, in one order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..pipeline.pairing import new_readings
from ..recording import Recording
from ..robot import Robot, Setup
from .agreement import agreement
from .description import description
from .evidence import BRIEF, Part, parts_of
from .finding import Finding, Severity
from .gravity import gravity
from .readings import DEAD, readings
from .reference import reference
from .resolution import resolution
from .rest import rest
from .timing import timing
from .turning import turning
from .wheels import dead_wheels, wheels


def check(recording: Recording, setup: Setup) -> tuple[Finding, ...]:
    """Return everything the data of a recording show about themselves and their description.

    Args:
        recording: a robot in motion; at rest, little of it can be checked.
        setup: robot and calibration as configured.
    """
    return tuple(_findings(recording, setup))


def _findings(recording: Recording, setup: Setup) -> Iterator[Finding]:
    parts = parts_of(recording, setup)
    single = list(readings(recording.imu, setup.robot))
    dead = [each for each in single if each.check in DEAD]
    upright = _upright(recording, parts or parts_of(recording, setup, BRIEF), setup, dead)
    encoders = list(wheels(recording, parts, setup.correction.wheel))
    motion = _motion(recording, parts, setup.robot, [*dead, *upright, *encoders])
    yield from description(setup.robot)
    yield from timing(recording)
    yield from (each for each in single if not _same_cause(each, [*upright, *motion]))
    yield from upright
    yield from rest(recording, setup)
    yield from encoders
    yield from motion
    yield from resolution(recording.wheels, [*encoders, *motion])
    yield from turning(parts, setup.robot, [*dead, *upright, *encoders, *motion])
    yield from reference(recording, parts, [*dead, *upright, *motion])


def _upright(
    recording: Recording, parts: Sequence[Part], setup: Setup, dead: Sequence[Finding]
) -> list[Finding]:
    """Return what gravity shows; nothing of an accelerometer that is dead in part."""
    if any(each.subject == "accelerometer" and each.severity is Severity.FAIL for each in dead):
        return []
    return list(gravity(parts, recording.imu.accel, setup.robot, setup.calibration))


def _motion(
    recording: Recording, parts: Sequence[Part], robot: Robot, others: Sequence[Finding]
) -> list[Finding]:
    """Return how wheels and IMU agree; nothing where it is clear already that they cannot."""
    if any(each.severity is Severity.FAIL for each in others):
        return []
    if recording.wheels is not None and dead_wheels(recording.wheels):
        return []
    wheels = None if recording.wheels is None else new_readings(recording.wheels)
    return list(agreement(parts, robot, wheels))


def _same_cause(finding: Finding, others: Sequence[Finding]) -> bool:
    """Return whether a reading beyond full scale is explained by a wrong unit."""
    return finding.check == "full scale" and any(
        each.subject == finding.subject and each.severity is Severity.FAIL for each in others
    )
