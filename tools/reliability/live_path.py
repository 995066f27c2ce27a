"""The live path without ROS: raw readings in, the tilt, its error and its validity out."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

from twbr_estimation.pipeline.pairing import WheelReading
from twbr_estimation.robot import Setup
from twbr_estimation.streams.correction import CorrectionStream
from twbr_estimation.streams.filter_configuration import FilterConfiguration, FilterSettings
from twbr_estimation.streams.filtering import FilterStream
from twbr_estimation.streams.guarded import StampedSamples

WRONG = math.radians(5.0)
"""Error from which on a tilt is wrong [rad]."""
RIGHT = math.radians(3.0)
"""Error up to which it is right again [rad]."""
OUTCOMES = (ArithmeticError, ValueError)


class Arrival(NamedTuple):
    """An IMU reading as it arrives, with the wheels' angle and the truth."""

    time: float
    """When it arrives [s]."""
    stamp: int
    """[ns]."""
    readings: tuple[float, ...]
    """Gyro x, y, z [rad/s] and accelerometer x, y, z [m/s^2]."""
    tilt: float
    """True tilt [rad]."""
    wheel: float | None = None
    """Angle of the wheels [rad]; None where there is no reading."""


class Output(NamedTuple):
    """A tilt that came out."""

    time: float
    """When [s]."""
    error: float
    """[rad], within half a turn."""
    valid: bool


@dataclass(slots=True)
class Judged:
    """What came out of a filter."""

    outputs: list[Output] = field(default_factory=list)
    raised: int = 0
    """Steps that raised."""
    not_finite: int = 0

    def wrong_and_valid(self) -> float:
        """Return the share of tilts that are wrong although they are said to be valid."""
        wrong = sum(abs(each.error) > WRONG and each.valid for each in self.outputs)
        return wrong / max(len(self.outputs), 1)

    def invalid(self) -> float:
        """Return the share of tilts that are not valid."""
        return sum(not each.valid for each in self.outputs) / max(len(self.outputs), 1)

    def recovered(self, since: float) -> float:
        """Return how long after `since` [s] the tilt was last wrong or not valid [s]."""
        bad = [
            each.time
            for each in self.outputs
            if each.time >= since and not (each.valid and abs(each.error) <= RIGHT)
        ]
        return max(bad, default=since) - since


def judged(name: str, arrivals: Iterable[Arrival], setup: Setup) -> Judged:
    """Run one filter as the nodes do; compare each tilt with the truth at its arrival."""
    correction = CorrectionStream(setup)
    settings = FilterSettings(filter=name)
    stream = FilterStream(FilterConfiguration(settings, {}, setup.robot))
    found, truth = Judged(), dict[int, float]()
    for each in arrivals:
        truth[each.stamp] = each.tilt
        if each.wheel is not None:
            _take(correction.add_wheels(_reading(each)), stream, each.time, truth, found)
        _take(correction.add_imu(each.stamp, each.readings), stream, each.time, truth, found)
    return found


def _reading(arrival: Arrival) -> WheelReading:
    return WheelReading(arrival.stamp, arrival.wheel or 0.0, 0.0, 1.0)


def _take(
    samples: StampedSamples,
    stream: FilterStream,
    time: float,
    truth: dict[int, float],
    found: Judged,
) -> None:
    for stamp, sample in samples:
        try:
            estimate = stream.step(sample)
        except OUTCOMES:
            found.raised += 1
            stream.reset()
            continue
        if not math.isfinite(estimate.tilt):
            found.not_finite += 1
            continue
        error = math.remainder(estimate.tilt - truth[stamp], 2.0 * math.pi)
        found.outputs.append(Output(time, error, stream.trusted))
