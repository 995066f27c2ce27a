"""The vertical as gyro and accelerometer alone have it, beside the navigation.

Only wheels that have proven right touch it, so it is what the navigation is held against. The
specific force, turned into level axes by the gyro, is averaged twice over a second and a half; its
direction is the vertical. It is kept in the level axes of the navigation and is turned wherever
they are.
Laidig and Seel 2023, VQF: Highly accurate IMU orientation estimation, section 3, after whom the
average is taken in axes that the gyro keeps.
"""

import math
from typing import NamedTuple

from ...samples import CorrectedSample
from .stillness import SLOW_TURNING
from .strapdown import Matrix, Quaternion, Vector, cross, matrix_of, rotated, unit

MEMORY = 1.5
"""Time over which the force, and then its direction, is averaged [s]."""
AGREEMENT = 1.0
"""Time in which it follows the navigation whose wheels have proven right [s]."""
BIAS_AGREEMENT = 3.0
"""Time in which its gyro bias follows that of such a navigation [s]."""
SWAY = 0.02
"""Spectral density of the direction's error from accelerations [rad^2 s]."""
BASE = 2.5e-5
"""Variance of the direction after a long time [rad^2]."""
BIAS_GAIN = 0.02
"""Rate of change of the gyro's bias per error of the direction [1/s^2]."""
REST_TIME = 0.03
"""Time in which the vertical goes to where the accelerometer points at rest [s]."""
SURELY_REST = 4.0
"""It goes there at once where its variance is so many times that of the direction at rest."""
SWAYING, SWAYED = 0.07, 2.5
"""Where the force stays further from the vertical than the first [rad], the square beyond adds to
the variance so many times."""
LEANING = 0.03
"""So far the specific force at rest may point from the vertical, however well that is known
[rad]."""
SURELY_RESTS = 3.0
"""Quiet readings of this length are rest wherever the specific force points [s]."""
BIAS_REST = 0.5
"""Time in which the gyro's bias is learnt at rest [s]."""
LEAN_ALLOWED, LEAN_PER_SCATTER = 0.006, 0.7
"""What accelerations may leave of the mean turn that is still to be made: the first [rad], and in
proportion to how it scatters. What is beyond, the gyro's bias makes."""
LEAN_GAIN = 0.05
"""Rate of change of the gyro's bias per mean turn beyond that [1/s^2]."""
LEAN_LAG = 2.0
"""A bias makes so many times as much of it [s]."""
LEAN_DOUBT = 2.0
"""Standard deviation of the tilt per mean turn beyond that, where no wheels are used."""
EXCUSED = 0.5
"""Share of what is unsettled of the vertical that excuses a navigation which is off it."""
LARGEST_LEARNT = 0.05
"""A larger bias is learnt at rest only [rad/s]."""
LEAST_FORCE = 2.0
"""A smaller specific force has no direction to trust [m/s^2]."""
UPSIDE_DOWN, AFRESH = 2.0, 0.2
"""Where the mean force points down for as long as makes `pending` the first [rad^2], a second and a
half, no throw does that: the vertical begins afresh there, with the second as its age [s]."""
FAR_AWAY = 1.0
"""What exceeds this of `pending` is doubt, whatever wheels say [rad^2]."""
GAIN_SHARE = 0.8
"""Share of the deviation of the gyro's gain that counts for turns of late: the navigation beside
the vertical is turned by the same gyro."""
CREEP = 0.005
"""A bias that drifts makes a mean turn grow by no more than this; an acceleration, by more
[rad/s]."""
PENDING_TIME = 2.0
"""Time over which the outstanding turn and its square are averaged [s]."""


class Vertical(NamedTuple):
    """The vertical without wheels, in the navigation's level axes."""

    up: Vector
    """Unit vector."""
    force: Vector
    """Average of the specific force [m/s^2]."""
    bias: Vector
    """Of the gyro, body axes [rad/s]."""
    age: float
    """Time that the averages stand for [s]."""
    pending: float
    """Mean square of the angle between `force` and `up` of late [rad^2]."""
    gain_error: tuple[float, float]
    """How far an error of the gyro's gain may have turned it of late, level axes [rad]."""
    lean: tuple[float, float]
    """Mean turn from `up` to `force` of late, level axes [rad]."""
    crept: tuple[float, float]
    """What of that came as slowly as a bias drifts, so that it may be one [rad]."""


def begin_vertical(force: Vector, bias: Vector, variance: float) -> Vertical:
    """Begin where the navigation is level, with a variance [rad^2] of that."""
    none = (0.0, 0.0)
    return Vertical((0.0, 0.0, 1.0), force, bias, SWAY / variance, 0.0, none, none, none)


def variance_of(vertical: Vertical) -> float:
    """Return the variance of the direction, for each level axis [rad^2]."""
    return BASE + unsettled_variance(vertical)


def unsettled_variance(vertical: Vertical) -> float:
    """Return the part of that which rest takes away [rad^2]."""
    x, y = vertical.gain_error
    return vertical.pending + unseen_variance(vertical) + x * x + y * y


def unseen_variance(vertical: Vertical) -> float:
    """Return what is left of the variance of turns that the gyro could not see [rad^2]."""
    return SWAY * (1.0 / vertical.age - 1.0 / MEMORY)


def swayed_variance(vertical: Vertical) -> float:
    """Return what lasting accelerations leave unknown where no wheel shows them [rad^2]."""
    return SWAYED * max(vertical.pending - SWAYING * SWAYING, 0.0)


def unexplained_lean(lean: tuple[float, float], pending: float) -> tuple[float, float]:
    """Return the part of a mean turn [rad] that its scatter does not explain, level axes [rad].

    Args:
        lean: `Vertical.lean`, or `Vertical.crept`.
        pending: `Vertical.pending`.
    """
    x, y = lean
    square = x * x + y * y
    if square < LEAN_ALLOWED * LEAN_ALLOWED:
        return 0.0, 0.0
    scatter = math.sqrt(max(pending - square, 0.0))
    allowed = LEAN_ALLOWED + LEAN_PER_SCATTER * scatter
    share = max(1.0 - allowed / math.sqrt(square), 0.0)
    return share * x, share * y


def unknown_bias(vertical: Vertical, body: Matrix) -> Vector:
    """Return what the gyro's bias is off by where a mean turn remains, body axes [rad/s]."""
    x, y = unexplained_lean(vertical.crept, vertical.pending)
    x, y = x / LEAN_LAG, y / LEAN_LAG
    return body[0] * x + body[3] * y, body[1] * x + body[4] * y, body[2] * x + body[5] * y


def leaning_variance(vertical: Vertical) -> float:
    """Return what a mean turn leaves unknown of the tilt where no wheels are used [rad^2]."""
    x, y = unexplained_lean(vertical.lean, vertical.pending)
    return LEAN_DOUBT * LEAN_DOUBT * (x * x + y * y)


def far_away_variance(vertical: Vertical) -> float:
    """Return what a mean force leaves unknown that points far from the vertical [rad^2]."""
    return max(vertical.pending - FAR_AWAY, 0.0)


def followed(
    vertical: Vertical,
    body: Matrix,
    rate: Vector,
    sample: CorrectedSample,
    unseen: float,
    gain: float,
) -> Vertical:
    """Return the vertical one sample later.

    Args:
        vertical: one sample ago.
        body: attitude of the navigation.
        rate: the rate that led to it, body axes [rad/s].
        sample: the new one.
        unseen: variance of a turn that the gyro could not see [rad^2].
        gain: standard deviation of the gyro's gain.
    """
    dt, b = sample.dt, vertical.bias
    drift = rotated(
        body,
        (
            dt * (rate[0] - sample.gyro_x + b[0]),
            dt * (rate[1] - sample.gyro_y + b[1]),
            dt * (rate[2] - sample.gyro_z + b[2]),
        ),
    )
    up, force = turned_by(vertical.up, drift), turned_by(vertical.force, drift)
    age, pending = vertical.age, vertical.pending
    part, keep = GAIN_SHARE * gain * dt, max(1.0 - dt / MEMORY, 0.0)
    turn = rotated(body, (part * rate[0], part * rate[1], part * rate[2]))
    gain_error = keep * vertical.gain_error[0] + turn[0], keep * vertical.gain_error[1] + turn[1]
    if unseen > 0.0:
        age = 1.0 / (1.0 / age + unseen / SWAY)
    accel = (sample.accel_x, sample.accel_y, sample.accel_z)
    size = math.sqrt(accel[0] * accel[0] + accel[1] * accel[1] + accel[2] * accel[2])
    if size < LEAST_FORCE:
        return Vertical(up, force, b, age, pending, gain_error, vertical.lean, vertical.crept)
    age = min(age + dt, MEMORY)
    felt, share = rotated(body, accel), min(dt / age, 1.0)
    force = (
        force[0] + share * (felt[0] - force[0]),
        force[1] + share * (felt[1] - force[1]),
        force[2] + share * (felt[2] - force[2]),
    )
    length = math.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2])
    if length < LEAST_FORCE:
        return Vertical(up, force, b, age, pending, gain_error, vertical.lean, vertical.crept)
    none = (0.0, 0.0)
    if pending > UPSIDE_DOWN and force[0] * up[0] + force[1] * up[1] + force[2] * up[2] < 0.0:
        return Vertical(unit(force), force, b, min(age, AFRESH), 0.0, gain_error, none, none)
    off = (force[0] / length - up[0], force[1] / length - up[1], force[2] / length - up[2])
    half = 0.5 * share
    up = unit((up[0] + half * off[0], up[1] + half * off[1], up[2] + half * off[2]))
    square = off[0] * off[0] + off[1] * off[1] + off[2] * off[2]
    new = min(dt / PENDING_TIME, 1.0)
    pending += new * (square - pending)
    error, (x, y) = cross(up, off), vertical.lean
    lean = x + new * (error[0] - x), y + new * (error[1] - y)
    crept = _grown(vertical.crept[0], lean[0], dt), _grown(vertical.crept[1], lean[1], dt)
    bias = learnt_bias(b, body, error, unexplained_lean(crept, pending), dt, age)
    return Vertical(up, force, bias, age, pending, gain_error, lean, crept)


def _grown(crept: float, lean: float, dt: float) -> float:
    """Return what has come slowly of a mean turn, one sample later [rad]."""
    step = CREEP * dt
    if lean >= 0.0:
        return min(max(crept, 0.0) + step, lean)
    return max(min(crept, 0.0) - step, lean)


def at_rest(
    vertical: Vertical, body: Matrix, accel: Vector, gyro: Vector, variance: float, dt: float
) -> Vertical:
    """Return the vertical of a body that lies still: it is where the accelerometer points.

    Args:
        vertical: before that was known.
        body: attitude of the navigation.
        accel: mean specific force since the body lies still, body axes [m/s^2].
        gyro: mean rate since then [rad/s].
        variance: of that direction [rad^2].
        dt: time since the last sample [s].
    """
    present = variance_of(vertical)
    share = min(dt / REST_TIME, 1.0) * max(1.0 - variance / present, 0.0)
    (x, y, z), (a, b, c) = unit(rotated(body, accel)), vertical.up
    if present > SURELY_REST * variance:
        a, b, c = x, y, z
        share = max(share, 1.0 - variance / present)
    bias = vertical.bias
    slow = share * min(dt / BIAS_REST, 1.0) / min(dt / REST_TIME, 1.0)
    p, q, r = gyro[0] - bias[0], gyro[1] - bias[1], gyro[2] - bias[2]
    if p * p + q * q + r * r > SLOW_TURNING * SLOW_TURNING:  # which has turned the vertical, too
        share = slow = 1.0
    up = unit((a + share * (x - a), b + share * (y - b), c + share * (z - c)))
    felt, old = rotated(body, accel), vertical.force
    force = (
        old[0] + share * (felt[0] - old[0]),
        old[1] + share * (felt[1] - old[1]),
        old[2] + share * (felt[2] - old[2]),
    )
    learnt = (bias[0] + slow * p, bias[1] + slow * q, bias[2] + slow * r)
    left, (p, q) = 1.0 - share, vertical.gain_error
    age, pending = _aged(vertical.age, share), left * vertical.pending
    lean = left * vertical.lean[0], left * vertical.lean[1]
    crept, off = (left * vertical.crept[0], left * vertical.crept[1]), (left * p, left * q)
    return Vertical(up, force, learnt, age, pending, off, lean, crept)


def contradicts_rest(
    vertical: Vertical, body: Matrix, accel: Vector, variance: float, lasted: float, pending: float
) -> bool:
    """Whether the specific force of quiet readings points where the vertical cannot be.

    A steady acceleration looks like rest to both sensors, but the gyro has not seen the turn to it.

    Args:
        vertical: before they count as rest.
        body: attitude of the navigation.
        accel: their mean specific force, body axes [m/s^2].
        variance: of its direction at rest [rad^2].
        lasted: for how long they have been quiet [s].
        pending: that of the vertical when they began to be; where it was small, what they have
            added to it excuses none of them [rad^2].
    """
    (x, y, z), (a, b, c) = unit(rotated(body, accel)), vertical.up
    square = (x - a) * (x - a) + (y - b) * (y - b) + (z - c) * (z - c)
    doubt = variance + variance_of(vertical)
    if pending < LEANING * LEANING:
        doubt += min(pending - vertical.pending, 0.0)
    return lasted < SURELY_RESTS and square > 9.0 * doubt + LEANING * LEANING


def _aged(age: float, share: float) -> float:
    """Return the age that leaves the given share less of the variance it stands for."""
    return min(1.0 / ((1.0 / age - 1.0 / MEMORY) * (1.0 - share) + 1.0 / MEMORY), MEMORY)


def agreed(vertical: Vertical, bias: Vector, dt: float) -> Vertical:
    """Return the vertical pulled towards the navigation's, whose wheels have proven right.

    Args:
        vertical: before that.
        bias: of the gyro, as the navigation has it [rad/s].
        dt: time since the last sample [s].
    """
    share, slow = min(dt / AGREEMENT, 1.0), min(dt / BIAS_AGREEMENT, 1.0)
    (p, q, r), (a, b, c) = vertical.bias, bias
    learnt = p + slow * (a - p), q + slow * (b - q), r + slow * (c - r)
    x, y, z = vertical.up
    up = unit((x - share * x, y - share * y, z + share * (1.0 - z)))
    keep = 1.0 - share
    x, y, z = vertical.force
    force = (keep * x, keep * y, z)
    age = _aged(vertical.age, share)
    (x, y), (p, q), (a, b) = vertical.lean, vertical.gain_error, vertical.crept
    lean, off, crept = (keep * x, keep * y), (keep * p, keep * q), (keep * a, keep * b)
    return Vertical(up, force, learnt, age, keep * vertical.pending, off, lean, crept)


def learnt_bias(
    bias: Vector, body: Matrix, error: Vector, lean: tuple[float, float], dt: float, age: float
) -> Vector:
    """Return the gyro's bias after one more sample.

    Args:
        bias: before it, body axes [rad/s].
        body: attitude of the navigation.
        error: turn still to be made, level axes [rad].
        lean: `unexplained_lean` [rad].
        dt: time since the last sample [s].
        age: of the vertical [s].
    """
    if age < MEMORY:
        return bias
    share, more = BIAS_GAIN * dt, LEAN_GAIN * dt
    x, y, z = share * error[0] + more * lean[0], share * error[1] + more * lean[1], share * error[2]
    return (
        _bounded(bias[0] + body[0] * x + body[3] * y + body[6] * z, bias[0]),
        _bounded(bias[1] + body[1] * x + body[4] * y + body[7] * z, bias[1]),
        _bounded(bias[2] + body[2] * x + body[5] * y + body[8] * z, bias[2]),
    )


def _bounded(bias: float, before: float) -> float:
    """Return a bias that is no larger than can be learnt in motion, or than it was [rad/s]."""
    limit = max(LARGEST_LEARNT, abs(before))
    return min(max(bias, -limit), limit)


def turned_by(vector: Vector, turn: Vector) -> Vector:
    """Return a vector after a small turn [rad], to second order."""
    first = cross(turn, vector)
    second = cross(turn, first)
    return (
        vector[0] + first[0] + 0.5 * second[0],
        vector[1] + first[1] + 0.5 * second[1],
        vector[2] + first[2] + 0.5 * second[2],
    )


def with_axes_turned(vertical: Vertical, turn: Vector) -> Vertical:
    """Return the same vertical after the navigation's attitude was repaired by a turn [rad]."""
    return Vertical(
        unit(turned_by(vertical.up, turn)),
        turned_by(vertical.force, turn),
        vertical.bias,
        vertical.age,
        vertical.pending,
        vertical.gain_error,
        vertical.lean,
        vertical.crept,
    )


def levelling(vertical: Vertical) -> Quaternion:
    """Return the turn that makes the vertical the navigation's."""
    x, y, z = vertical.up
    beyond = 1.0 + z
    if beyond < 1e-12:
        return 0.0, 1.0, 0.0, 0.0
    scale = 1.0 / math.sqrt(beyond * beyond + x * x + y * y)
    return beyond * scale, y * scale, -x * scale, 0.0


def body_by(vertical: Vertical, body: Matrix) -> Matrix:
    """Return the attitude of the body in axes that are level by the vertical."""
    level = matrix_of(levelling(vertical))
    a, d, g = rotated(level, (body[0], body[3], body[6]))
    b, e, h = rotated(level, (body[1], body[4], body[7]))
    c, f, i = rotated(level, (body[2], body[5], body[8]))
    return a, b, c, d, e, f, g, h, i


def levelled(vertical: Vertical, level: Quaternion) -> Vertical:
    """Return the vertical in axes that `levelling` has turned."""
    force = rotated(matrix_of(level), vertical.force)
    age, pending, up = vertical.age, vertical.pending, (0.0, 0.0, 1.0)
    gain_error, lean, crept = vertical.gain_error, vertical.lean, vertical.crept
    return Vertical(up, force, vertical.bias, age, pending, gain_error, lean, crept)


def off_level(vertical: Vertical) -> float:
    """Return the square of how far the navigation is from the vertical [rad^2]."""
    x, y, z = vertical.up
    return x * x + y * y if z > 0.0 else 4.0


def apart_variance(vertical: Vertical) -> float:
    """Return how far the navigation is off beyond what the vertical itself excuses [rad^2]."""
    return max(off_level(vertical) - EXCUSED * unsettled_variance(vertical), 0.0)


def bias_remarks(vertical: Vertical) -> tuple[str, ...]:
    """Return a sentence about a bias of the gyro that only rest could show."""
    if max(map(abs, vertical.bias)) <= LARGEST_LEARNT:
        return ()
    about = ", ".join(f"{round(each, 2) + 0.0:.2f}" for each in vertical.bias)  # and no -0.00
    said = f"the gyro shows ({about}) rad/s at rest, more than calibration leaves"
    return (f"{said}; calibrate its bias (still)",)
