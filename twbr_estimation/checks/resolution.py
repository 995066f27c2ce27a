"""Steps and noise of the wheels' readings, and what they hide."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ..pipeline.pairing import new_readings
from ..recording import FloatArray, WheelTrack
from .band import SHORT
from .evidence import STEP
from .finding import Finding, Severity, passed
from .timing import period_of

COARSE = 2.0 * math.pi / 100.0
"""Steps of an encoder above this are worth a warning [rad]."""
NOISY = 0.02
"""Noise of the wheels' readings that is worth a warning [rad]."""
_STANDING = 0.2  # share of equal readings from which on the least step is the encoder's
_STEP_GAIN = 120.0  # acceleration [1/s^2] in the band of an error of 1 rad that stays for a while
_THIRD = math.sqrt(20.0)  # gain of a third difference for white noise
_NORMAL_MAD = 1.4826


def resolution(track: WheelTrack | None, others: Sequence[Finding]) -> Iterator[Finding]:
    """Yield that an encoder is coarse or its readings are noisy.

    Args:
        track: readings of the wheels.
        others: what is known about them; in another unit, steps and noise are no angles.
    """
    wrong = any(each.subject == "wheels" and each.severity is Severity.FAIL for each in others)
    if track is None or track.stamps.size < 2 or wrong:
        return
    new = new_readings(track)
    if new.stamps.size < track.stamps.size:
        yield _repeated(track, new)
    track = new
    step, noise = step_of(track), noise_of(track)
    if noise > NOISY + step:
        yield Finding(
            Severity.FAIL if noise > 10.0 * NOISY else Severity.WARN,
            "wheels",
            "noise",
            f"the readings scatter by {noise:.2g} rad from one to the next, a good encoder's by "
            "less than its step: mend wiring or driver",
            noise / NOISY,
        )
    elif step > COARSE:
        yield Finding(
            Severity.WARN,
            "wheels",
            "resolution",
            f"the angle changes in steps of {step:.3g} rad, {2.0 * math.pi / step:.3g} a turn: too "
            "coarse for the wheels' acceleration; count all four edges, or give the motor's side "
            "and the gear's ratio",
            step,
        )
    elif step > 0.0:
        yield passed("wheels", "resolution", f"the angle changes in steps of {step:.2g} rad")


def _repeated(track: WheelTrack, new: WheelTrack) -> Finding:
    sent, read = period_of(track.stamps), period_of(new.stamps)
    return Finding(
        Severity.WARN,
        "wheels",
        "repeats",
        f"each reading is sent again until the encoder is read anew, every {1e3 * read:.3g} ms, "
        f"not {1e3 * sent:.3g} ms; the repeats are left out: send each reading once, or read "
        "more often",
        read / sent,
    )


def step_of(track: WheelTrack) -> float:
    """Return the largest step of an encoder [rad]; 0 where it is not seen."""
    return max((_step(column) for column in track.angle.T), default=0.0)


def _step(angle: FloatArray) -> float:
    sizes = np.abs(np.diff(angle))
    moved = sizes[sizes > 1e-9]
    if not moved.size or moved.size > (1.0 - _STANDING) * sizes.size:
        return 0.0
    return float(np.quantile(moved, 0.05))


def noise_of(track: WheelTrack) -> float:
    """Return the largest white noise of an encoder's readings [rad], its steps included."""
    third = np.diff(track.angle, 3, axis=0)
    if not third.size:
        return 0.0
    return _NORMAL_MAD * float(np.median(np.abs(third), axis=0).max()) / _THIRD


def acceleration_noise(track: WheelTrack) -> float:
    """Return the noise of the wheels' second derivative in the band [rad/s^2]."""
    steps = _STEP_GAIN * step_of(track) / math.sqrt(12.0)
    noise = noise_of(track) * math.sqrt(max(period_of(track.stamps), STEP))
    white = noise * math.sqrt(3.0 / (8.0 * math.sqrt(math.pi) * SHORT**5))
    return max(steps, white)
