"""Strapdown integration: from body rates and specific forces to attitude and acceleration.

Quaternions are (w, x, y, z) and turn body axes into a level frame whose z axis points up;
its heading is wherever the gyro left it. Matrices are nine numbers, row by row. Everything
is plain floats and tuples, so that one source runs interpreted and compiled.
Titterton and Weston, Strapdown Inertial Navigation Technology, chapter 11.
"""

from __future__ import annotations

import math

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]

_SMALL_TURN = 0.05  # below this, series are as exact as sine and cosine, and quicker [rad]


def rotation_of(turn: Vector) -> Quaternion:
    """Return the quaternion of a rotation vector [rad]."""
    x, y, z = turn
    square = 0.25 * (x * x + y * y + z * z)
    if square < 0.25 * _SMALL_TURN * _SMALL_TURN:
        share = 0.5 - square * (1.0 / 12.0 - square * (1.0 / 240.0 - square / 10080.0))
        whole = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0)))
    else:
        half = math.sqrt(square)
        share, whole = 0.5 * math.sin(half) / half, math.cos(half)
    return whole, share * x, share * y, share * z


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation `b` followed by `a`, of unit length."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    w = aw * bw - ax * bx - ay * by - az * bz
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    scale = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return w * scale, x * scale, y * scale, z * scale


def turned(attitude: Quaternion, before: Vector, now: Vector, dt: float, held: float) -> Quaternion:
    """Return the attitude after `dt` seconds between two readings of the body rate [rad/s].

    The rate is taken as linear in between; the cross product is what a turning axis adds
    to its mean (coning). A first reading that was `held` for some time [s] and integrated as if
    it were constant is made linear, too.
    """
    old, new, coning = 0.5 * (dt - held), 0.5 * (dt + held), (dt + held) * (dt - 2.0 * held) / 12.0
    a, b, c = before
    x, y, z = now
    turn = (
        old * a + new * x + coning * (b * z - c * y),
        old * b + new * y + coning * (c * x - a * z),
        old * c + new * z + coning * (a * y - b * x),
    )
    return product(attitude, rotation_of(turn))


def matrix_of(q: Quaternion) -> Matrix:
    """Return the matrix that turns body axes into level axes."""
    w, x, y, z = q
    a, b, c = 2.0 * x, 2.0 * y, 2.0 * z
    ax, by, cz = a * x, b * y, c * z
    bx, cx, cy = b * x, c * x, c * y
    aw, bw, cw = a * w, b * w, c * w
    return (
        1.0 - (by + cz), bx - cw, cx + bw,
        bx + cw, 1.0 - (ax + cz), cy - aw,
        cx - bw, cy + aw, 1.0 - (ax + by),
    )  # fmt: skip


def rotated(m: Matrix, v: Vector) -> Vector:
    """Return a body vector in level axes."""
    a, b, c, d, e, f, g, h, i = m
    x, y, z = v
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def unit(vector: Vector) -> Vector:
    """Return a vector of length 1 in the same direction."""
    x, y, z = vector
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-9:
        return 0.0, 0.0, 1.0
    return x / length, y / length, z / length


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def tilt_of(m: Matrix) -> float:
    """Return the tilt: the angle of the vertical in the body's x-z plane [rad]."""
    return math.atan2(-m[6], m[8])


def tilt_ahead(tilt: float, m: Matrix, rate: Vector, time: float) -> float:
    """Return the tilt that body rates [rad/s] lead to within a short time [rad].

    Args:
        tilt: that of the attitude [rad].
        m: the attitude.
        rate: body axes [rad/s].
        time: [s].
    """
    x = m[6] + time * (m[7] * rate[2] - m[8] * rate[1])
    z = m[8] + time * (m[6] * rate[1] - m[7] * rate[0])
    aside, along = m[6] * z - m[8] * x, m[8] * z + m[6] * x
    if not abs(aside) < _SMALL_TURN * along:
        return math.atan2(-x, z)
    turn = aside / along
    square = turn * turn
    ahead = tilt + turn * (1.0 - square * (1.0 / 3.0 - square * (0.2 - square * (1.0 / 7.0))))
    return ahead if abs(ahead) <= math.pi else ahead - math.copysign(2.0 * math.pi, ahead)


def attitude_at(tilt: float, accel: Vector) -> Quaternion:
    """Return the attitude of that tilt; the accelerometer says how far it leans sideways."""
    force = math.sqrt(accel[0] * accel[0] + accel[1] * accel[1] + accel[2] * accel[2])
    side = accel[1] / force if force > 0.0 else 0.0
    level = math.sqrt(max(1.0 - side * side, 0.0))
    roll = math.atan2(side, level * math.cos(tilt))
    pitch = math.asin(min(max(level * math.sin(tilt), -1.0), 1.0))
    return product(rotation_of((0.0, pitch, 0.0)), rotation_of((roll, 0.0, 0.0)))


def heading_of(m: Matrix) -> tuple[float, float]:
    """Return the level direction in which the wheels roll, as a unit vector.

    It is across the axle, so that it holds at any tilt, upside down as well.
    """
    length = math.sqrt(m[1] * m[1] + m[4] * m[4])
    if length < 1e-6:
        return 1.0, 0.0
    return m[4] / length, -m[1] / length
