"""Compare a compiled step with the interpreted one, on a drive made for that."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..errors import WorkerError
from ..filters.base import filter_named
from ..pipeline.correction import Corrector
from ..pipeline.watched_filter import WatchedFilter
from ..robot import Setup
from ..samples import STANDARD_GRAVITY, CorrectedSample, Sample
from .files import CORRECTION
from .providing import compiled_correction, compiled_filter

SAMPLES = 1500
"""Length of the drive: at 200 Hz with a rest, swings, slipping wheels and saturation."""
_DT = 0.005


def raw_samples() -> Iterator[Sample]:
    """Yield a robot that rests, swings about its axle, is pushed, and turns its wheels in vain."""
    for index in range(SAMPLES):
        time = index * _DT
        swinging = min(max(time - 1.0, 0.0), 1.0)
        tilt = 0.2 * swinging * math.sin(4.0 * time)
        rate = 0.8 * swinging * math.cos(4.0 * time)
        noise = 0.01 * math.sin(997.0 * time)
        if 1000 <= index < 1012:
            rate = 40.0  # beyond the gyro's range
        slipping = 3.0 * max(time - 6.0, 0.0)
        gyro = 0.0 if 700 <= index < 730 else 1.0  # the chip is silent
        accel = 0.0 if 700 <= index < 760 else 1.0  # the accelerometer for longer
        yield Sample(
            _DT if index % 100 else 0.04,
            gyro * noise,
            gyro * (rate - noise),
            gyro * 2.0 * noise,
            accel * (-STANDARD_GRAVITY * math.sin(tilt) + noise),
            accel * noise,
            accel * (STANDARD_GRAVITY * math.cos(tilt) - noise),
            slipping - tilt,
            noise,
            2.0 if index % 400 < 390 else 0.0,
        )


def corrected_samples() -> Iterator[CorrectedSample]:
    """Yield the same, corrected."""
    return map(Corrector(Setup()).step, raw_samples())


def check(name: str) -> None:
    """Compare the prepared step of that name with the interpreted one.

    Raises:
        WorkerError: a number differs, or there is no such step.
    """
    if name == CORRECTION:
        _compare_corrections()
    else:
        _compare_filters(name)


def _compare_corrections() -> None:
    code = compiled_correction()
    if code is None:
        raise WorkerError(f"{CORRECTION}: no machine code that this computer can load")
    interpreted, compiled = Corrector(Setup()), Corrector(Setup())
    compiled.use(code)
    for sample in raw_samples():
        _require_equal(CORRECTION, interpreted.step(sample), compiled.step(sample))


def _compare_filters(name: str) -> None:
    entry = filter_named(name)
    code = compiled_filter(entry)
    if code is None:
        raise WorkerError(f"{name}: no machine code that this computer can load")
    interpreted, compiled = WatchedFilter(entry), WatchedFilter(entry)
    compiled.use(code)
    for sample in corrected_samples():
        _require_equal(name, interpreted.step(sample), compiled.step(sample))
        if interpreted.trusted != compiled.trusted or interpreted.doubt != compiled.doubt:
            raise WorkerError(f"{name}: the compiled monitor judges otherwise")


def _require_equal(name: str, expected: tuple[float, ...], found: tuple[float, ...]) -> None:
    if expected != found:
        raise WorkerError(f"{name}: {found} by machine code, {expected} interpreted")
