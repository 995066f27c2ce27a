"""Peers that are called once a sample from Python: imufusion, ahrs, attipy, gtsam."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..recording import FloatArray
from ..samples import STANDARD_GRAVITY
from .base import GYRO_NOISE, SETTLING_TIME, Inertial, Peer, level_attitude

DIRECTION_SPREAD = 0.17
"""Standard deviation of gravity's direction for gtsam's equivariant filter [rad]."""


def _imufusion(samples: Inertial) -> FloatArray:
    import imufusion

    settings = imufusion.AhrsSettings()
    settings.sample_rate = 1.0 / samples.period
    settings.acceleration_rejection, settings.rejection_timeout = 10.0, 5.0
    estimator = imufusion.Ahrs()
    estimator.set_settings(settings)
    estimator.set_quaternion(np.array(level_attitude(samples.accel[0])))
    estimator.skip_startup()
    attitude = np.empty((samples.gyro.shape[0], 4))
    rates, forces = np.degrees(samples.gyro), samples.accel / STANDARD_GRAVITY
    for i, (rate, force) in enumerate(zip(rates, forces, strict=True)):
        estimator.update_no_magnetometer(rate, force)
        attitude[i] = estimator.get_quaternion()
    return attitude


def _ahrs(name: str, **options: Any) -> Any:
    """Return a peer's function for an estimator of the package `ahrs`, with its defaults."""

    def run(samples: Inertial) -> FloatArray:
        from ahrs import filters

        estimator = getattr(filters, name)(
            gyr=samples.gyro,
            acc=samples.accel,
            frequency=1.0 / samples.period,
            q0=np.array(level_attitude(samples.accel[0])),
            **options,
        )
        return np.asarray(estimator.Q, dtype=np.float64)

    return run


def _attipy(samples: Inertial) -> FloatArray:
    import attipy

    start = level_attitude(samples.accel[0])
    estimator = attipy.AHRS(1.0 / samples.period, q_nb=start, nav_frame="ENU")
    attitude = np.empty((samples.gyro.shape[0], 4))
    for i, (rate, force) in enumerate(zip(samples.gyro, samples.accel, strict=True)):
        estimator.update(force, rate)
        attitude[i] = estimator.q_nb
    return attitude


def _invariant(samples: Inertial) -> FloatArray:
    """Return the attitude by gtsam's invariant EKF on SO(3), gravity's direction its update."""
    import gtsam

    start = gtsam.Rot3.Quaternion(*level_attitude(samples.accel[0]))
    estimator = gtsam.InvariantEKFRot3(start, 0.01 * np.eye(3))
    process = (GYRO_NOISE * samples.period) ** 2 * np.eye(3)
    spread = (GYRO_NOISE * SETTLING_TIME) ** 2 * np.eye(3)
    directions = _directions(samples)
    attitude = np.empty((directions.shape[0], 4))
    for i, (rate, seen) in enumerate(zip(samples.gyro, directions, strict=True)):
        estimator.predict(rate, samples.period, process)
        x, y, z = up = estimator.state().matrix()[2]
        slope = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        estimator.updateWithVector(up, slope, seen, spread)
        attitude[i] = _quaternion(estimator.state())
    return attitude


def _equivariant(samples: Inertial) -> FloatArray:
    """Return the attitude by gtsam's equivariant filter with gyro bias, from level."""
    import gtsam

    estimator = gtsam.abc.AbcEquivariantFilter1()
    noise, spread = GYRO_NOISE**2 * np.eye(6), DIRECTION_SPREAD**2 * np.eye(3)
    noise[3:, 3:] *= 1e-3
    vertical = gtsam.Unit3(np.array([0.0, 0.0, 1.0]))
    directions = _directions(samples)
    attitude = np.empty((directions.shape[0], 4))
    for i, (rate, seen) in enumerate(zip(samples.gyro, directions, strict=True)):
        estimator.predict(rate, noise, samples.period)
        estimator.update(gtsam.Unit3(seen), vertical, spread, -1)
        attitude[i] = _quaternion(estimator.attitude())
    return attitude


def _directions(samples: Inertial) -> FloatArray:
    length = np.linalg.norm(samples.accel, axis=1, keepdims=True)
    return np.asarray(samples.accel / np.maximum(length, 1e-9))


def _quaternion(rotation: Any) -> tuple[float, float, float, float]:
    found = rotation.toQuaternion()
    return found.w(), found.x(), found.y(), found.z()


PEERS = (
    Peer("imufusion", "imufusion", _imufusion),
    Peer("ahrs Madgwick", "ahrs", _ahrs("Madgwick")),
    Peer("ahrs Mahony", "ahrs", _ahrs("Mahony")),
    Peer("ahrs EKF", "ahrs", _ahrs("EKF")),
    Peer("attipy", "attipy", _attipy),
    Peer("gtsam invariant", "gtsam", _invariant),
    Peer("gtsam equivariant", "gtsam", _equivariant),
)
"""imufusion with the gain and the rejection of its own example; ahrs and attipy with their
defaults; gtsam's filters have none: the invariant one's weights give VQF's default time constant,
the equivariant one, whose first covariance cannot be set from Python, has the best of five weights
on one drive."""
