"""A sample with other readings in place of those that are known to be wrong."""

from __future__ import annotations

from ...samples import CorrectedSample


def adjusted(
    sample: CorrectedSample, yaw_rate: float, yaw_variance: float, yaw_clipped: float, factor: float
) -> CorrectedSample:
    """Return the sample with another yaw rate and a scaled specific force.

    Args:
        sample: as read.
        yaw_rate: about the body's z axis [rad/s].
        yaw_variance: its variance [(rad/s)^2].
        yaw_clipped: 1 where it is beyond the gyro's range, else 0.
        factor: of the specific force.
    """
    return CorrectedSample(
        dt=sample.dt,
        angle=sample.angle,
        angle_variance=sample.angle_variance,
        gyro_x=sample.gyro_x,
        gyro_y=sample.gyro_y,
        gyro_z=yaw_rate,
        accel_x=factor * sample.accel_x,
        accel_y=factor * sample.accel_y,
        accel_z=factor * sample.accel_z,
        gyro_variance_x=sample.gyro_variance_x,
        gyro_variance_y=sample.gyro_variance_y,
        gyro_variance_z=yaw_variance,
        accel_variance_x=sample.accel_variance_x,
        accel_variance_y=sample.accel_variance_y,
        accel_variance_z=sample.accel_variance_z,
        wheel_angle=sample.wheel_angle,
        wheel_difference=sample.wheel_difference,
        wheel_count=sample.wheel_count,
        voltage=sample.voltage,
        voltage_difference=sample.voltage_difference,
        motor_count=sample.motor_count,
        gyro_saturated_x=sample.gyro_saturated_x,
        gyro_saturated_y=sample.gyro_saturated_y,
        gyro_saturated_z=yaw_clipped,
        accel_saturated_x=sample.accel_saturated_x,
        accel_saturated_y=sample.accel_saturated_y,
        accel_saturated_z=sample.accel_saturated_z,
    )
