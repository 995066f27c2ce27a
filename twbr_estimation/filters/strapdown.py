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

_SMALL_TURN = 1e-4  # below this a turn's sine is replaced by its series [rad]


def rotation_of(turn: Vector) -> Quaternion:
    """Return the quaternion of a rotation vector [rad]."""
    angle = math.sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])
    share = 0.5 - angle * angle / 48.0
    if angle > _SMALL_TURN:
        share = math.sin(0.5 * angle) / angle
    return math.cos(0.5 * angle), share * turn[0], share * turn[1], share * turn[2]


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation `b` followed by `a`, of unit length."""
    w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    scale = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return w * scale, x * scale, y * scale, z * scale


def turned(attitude: Quaternion, before: Vector, now: Vector, dt: float) -> Quaternion:
    """Return the attitude after `dt` seconds between two readings of the body rate [rad/s].

    The rate is taken as linear in between; the cross product is what a turning axis adds
    to its mean (coning).
    """
    half, coning = 0.5 * dt, dt * dt / 12.0
    return product(
        attitude,
        rotation_of(
            (
                half * (before[0] + now[0]) + coning * (before[1] * now[2] - before[2] * now[1]),
                half * (before[1] + now[1]) + coning * (before[2] * now[0] - before[0] * now[2]),
                half * (before[2] + now[2]) + coning * (before[0] * now[1] - before[1] * now[0]),
            )
        ),
    )


def matrix_of(q: Quaternion) -> Matrix:
    """Return the matrix that turns body axes into level axes."""
    w, x, y, z = q
    return (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )


def rotated(m: Matrix, v: Vector) -> Vector:
    """Return a body vector in level axes."""
    return (
        m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
        m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
        m[6] * v[0] + m[7] * v[1] + m[8] * v[2],
    )


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


def attitude_at(tilt: float, accel: Vector) -> Quaternion:
    """Return the attitude of that tilt; the accelerometer says how far it leans sideways."""
    force = math.sqrt(accel[0] * accel[0] + accel[1] * accel[1] + accel[2] * accel[2])
    side = accel[1] / force if force > 0.0 else 0.0
    level = math.sqrt(max(1.0 - side * side, 0.0))
    roll = math.atan2(side, level * math.cos(tilt))
    pitch = math.asin(min(max(level * math.sin(tilt), -1.0), 1.0))
    return product(rotation_of((0.0, pitch, 0.0)), rotation_of((roll, 0.0, 0.0)))


def heading_of(m: Matrix) -> tuple[float, float]:
    """Return the level direction the robot faces, as a unit vector."""
    length = math.sqrt(m[0] * m[0] + m[3] * m[3])
    if length < 1e-6:
        return 1.0, 0.0
    return m[0] / length, m[3] / length
