"""The sensor's acceleration in the world, as a linear model of geometry and errors.

Turned by the reference's tilt into world axes, what the accelerometer reads is (Laddach 2022
(13)-(21), lever arm (x, z), encoder angle theta, tilt phi)

    forward:  d2/dt2 [ r theta + c phi + z sin(phi) + x cos(phi) ]
    up:       g + d2/dt2 [ z cos(phi) - x sin(phi) ]

with wheel radius r, and c = r where the encoder sits on the body, c = 0 where it is referred
to ground. Nothing but encoder angles is differentiated, and those under the smoothing that
both sides share. Pitch of the mounting and delays enter to first order. What is left of the
accelerometer's scale errors is a smooth function of the force along each axis: bias, gain and
a few waves of it are fitted along, so that they do not falsify the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..recording import FloatArray
from ..samples import STANDARD_GRAVITY
from .gyro_scale import BLOCK
from .regression import Regression, regress
from .signals import Signals

FORCE_SPAN = 10.0
"""Half the wavelength of the first wave of a scale error [m/s^2]."""
WAVES_X, WAVES_Z = 6, 3
"""Number of waves along each axis; fewer where gravity hides them."""
TERMS = (
    "radius",
    "up",
    "forward",
    "pitch",
    "accel_delay",
    "wheel_delay",
    "bias_x",
    "bias_z",
    "gain_x",
    "gain_z",
    *(f"wave_x{number}" for number in range(2 * WAVES_X)),
    *(f"wave_z{number}" for number in range(2 * WAVES_Z)),
)
"""The unknowns; `body_turn` joins them while the encoder's placement is open."""
_ROUNDS = 3
_NORMAL_MAD = 1.4826


@dataclass(frozen=True, slots=True)
class KinematicFit:
    """Unknowns by name, with their standard errors, SI units."""

    values: dict[str, float]
    errors: dict[str, float]
    share: float
    """Share of the drive that could be used."""


def fit_kinematics(
    drives: Sequence[Signals], width: float, tilt_delay: float, body_turn: float | None
) -> KinematicFit:
    """Estimate the geometry from drives of one robot.

    Args:
        drives: all with wheels.
        width: standard deviation of the smoothing [s].
        tilt_delay: delay of the reference against the gyro [s].
        body_turn: c / r, 1 or 0; None estimates it.
    """
    delays = {"wheel_delay": tilt_delay, "accel_delay": 0.0}
    names = (*TERMS, "body_turn") if body_turn is None else TERMS
    balance = 1.0
    for _ in range(_ROUNDS):
        forward, up, blocks, share = _stacked(drives, width, tilt_delay, delays, body_turn)
        fit, balance = _solve(forward, up, blocks, balance)
        values = dict(zip(names, fit.values.tolist(), strict=True))
        errors = dict(zip(names, fit.errors.tolist(), strict=True))
        radius = values["radius"]
        delays["wheel_delay"] += values["wheel_delay"] / radius
        delays["accel_delay"] += values["accel_delay"]
    errors["wheel_delay"] /= abs(radius)
    if body_turn is None:
        values["body_turn"] /= radius
        errors["body_turn"] /= abs(radius)
    return KinematicFit({**values, **delays}, errors, share)


def _solve(
    forward: FloatArray, up: FloatArray, blocks: FloatArray, balance: float
) -> tuple[Regression, float]:
    """Solve both equations at once; `balance` weighs the second by the noise of the first."""
    rows = np.vstack([forward, up * balance])
    fit = regress(rows[:, 1:], rows[:, 0], np.concatenate([blocks, blocks]))
    misfits = [each[:, 0] - each[:, 1:] @ fit.values for each in (forward, up)]
    noise = [_NORMAL_MAD * float(np.median(np.abs(misfit))) for misfit in misfits]
    return fit, noise[0] / max(noise[1], 1e-12)


def _stacked(
    drives: Sequence[Signals],
    width: float,
    tilt_delay: float,
    delays: dict[str, float],
    body_turn: float | None,
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return target and terms of both equations, (n, 1 + k) each, and the blocks, (n,)."""
    forward, up, blocks = [], [], []
    for index, drive in enumerate(drives):
        rows = drive.rows(drive.accel_usable, width)
        equations = _equations(drive, width, tilt_delay, delays, body_turn)
        forward.append(equations[0][rows])
        up.append(equations[1][rows])
        blocks.append(np.floor(drive.time[rows] / BLOCK) + 1e6 * index)
    everything = sum(drive.rows(np.ones(drive.time.size, bool), width).size for drive in drives)
    share = sum(each.size for each in blocks) / max(everything, 1)
    return np.vstack(forward), np.vstack(up), np.concatenate(blocks), share


def _equations(
    drive: Signals,
    width: float,
    tilt_delay: float,
    delays: dict[str, float],
    body_turn: float | None,
) -> tuple[FloatArray, FloatArray]:
    """Return target and terms of one drive, in the order of `TERMS`."""
    tilt, turned = drive.tilt(tilt_delay), drive.turned(delays["wheel_delay"])
    sine, cosine, zero = np.sin(tilt), np.cos(tilt), np.zeros(tilt.size)
    time, lag = drive.time, delays["accel_delay"]
    x, z = (np.interp(time + lag, time, force) for force in (drive.accel_x, drive.accel_z))

    def world(ahead: FloatArray, above: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Turn body axes into world axes, smoothed."""
        return (
            drive.smooth(ahead * cosine + above * sine, width),
            drive.smooth(above * cosine - ahead * sine, width),
        )

    def bent(angle: FloatArray, order: int = 2) -> FloatArray:
        return drive.smooth(angle, width, order)

    force, one = world(x, z), np.ones(tilt.size)
    changing = world(-np.gradient(x, drive.dt), -np.gradient(z, drive.dt))
    rolled = bent(turned) + (0.0 if body_turn is None else body_turn * bent(tilt))
    pairs = [
        (force[0], force[1] - STANDARD_GRAVITY),
        (rolled, zero),
        (bent(sine), bent(cosine)),
        (bent(cosine), -bent(sine)),
        (-force[1], force[0]),
        changing,
        (-bent(turned, 3), zero),
        world(one, zero),
        world(zero, one),
        world(x, zero),
        world(zero, z),
        *(world(wave, zero) for wave in _waves(x, WAVES_X)),
        *(world(zero, wave) for wave in _waves(z, WAVES_Z)),
    ]
    if body_turn is None:
        pairs.append((bent(tilt), zero))
    ahead, above = zip(*pairs, strict=True)
    return np.column_stack(ahead), np.column_stack(above)


def _waves(force: FloatArray, count: int) -> list[FloatArray]:
    """Return the smooth functions of a force that model its scale error, (n,) each."""
    phases = [force * (np.pi / FORCE_SPAN * number) for number in range(1, count + 1)]
    return [wave(phase) for phase in phases for wave in (np.sin, np.cos)]
