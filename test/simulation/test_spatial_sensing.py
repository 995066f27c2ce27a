from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from twbr_estimation.robot import Robot
from twbr_estimation.ros_messages import tilt_of_quaternion
from twbr_estimation.samples import STANDARD_GRAVITY
from twbr_estimation.simulation import Simulated, simulate
from twbr_estimation.simulation.disturbances import STEP
from twbr_estimation.simulation.spatial_sensing import attitudes, imu_input, wheel_angles
from twbr_estimation.simulation.turning import Turning
from twbr_estimation.simulation.worlds import W2, W4

ARM = (0.02, 0.01, 0.135)
TRACK, RADIUS = 0.16, 0.0375
TIME = np.arange(0.0, 4.0, STEP)
TILT = 0.2 * np.sin(5.0 * TIME)
YAW = 1.5 * np.sin(2.0 * TIME)
ROLL = 0.08 * np.sin(9.0 * TIME + 0.3)
SPEED = 0.6 * np.sin(3.0 * TIME)
RISE = 0.004 * np.sin(7.0 * TIME)
NOTHING = np.zeros_like(TIME)
PLANAR = np.column_stack(
    [
        SPEED,
        TILT,
        np.cos(5.0 * TIME),
        -0.05 * np.sin(11.0 * (TIME - 0.5 * STEP)) * 121.0 / 49.0,  # of the step before
        NOTHING,
        NOTHING,
        NOTHING,
        0.2 * (1.0 - np.cos(3.0 * TIME)),
    ]
)
TURNING = Turning(
    yaw_rate=3.0 * np.cos(2.0 * TIME),
    roll=ROLL,
    roll_rate=0.72 * np.cos(9.0 * TIME + 0.3),
    lift_speed=0.028 * np.cos(7.0 * TIME),
    slip=np.zeros((TIME.size, 2)),
)


def rotations() -> Rotation:
    """Heading, then the roll of the axle, then the tilt: SciPy's intrinsic z-x'-y''."""
    return Rotation.from_euler("ZXY", np.column_stack([YAW, ROLL, TILT]))


def position(of: np.ndarray) -> np.ndarray:
    """Where a point of the body is in the world, for one body vector or one a row."""
    along = np.column_stack([SPEED * np.cos(YAW), SPEED * np.sin(YAW), NOTHING])
    middle = cumulative_trapezoid(along, dx=STEP, axis=0, initial=0.0)
    middle[:, 2] = RISE + 0.05 * np.sin(11.0 * TIME) / 49.0
    return middle + rotations().apply(of)


def test_the_accelerometer_measures_the_second_difference_of_the_position() -> None:
    path = position(np.array(ARM))
    acceleration = (path[2:] - 2.0 * path[1:-1] + path[:-2]) / STEP**2
    acceleration[:, 2] += STANDARD_GRAVITY
    expected = rotations()[1:-1].apply(acceleration, inverse=True)
    force = imu_input(PLANAR, TURNING, ARM).force
    at_the_stamps = 0.5 * (force[1:-1] + force[2:])  # they are means over the steps before
    np.testing.assert_allclose(at_the_stamps[2:-2], expected[2:-2], atol=2e-4)
    assert np.ptp(expected[:, 1]) > 3.0  # turning has an effect


def test_the_gyro_measures_the_difference_of_the_attitude() -> None:
    turned = (rotations()[:-2].inv() * rotations()[2:]).as_rotvec() / (2.0 * STEP)
    rate = imu_input(PLANAR, TURNING, ARM).rate[1:-1]
    np.testing.assert_allclose(rate[2:-2], turned[2:-2], atol=1e-5)
    assert np.ptp(rate, axis=0).min() > 1.0


def test_wheels_roll_as_their_contact_with_the_ground_moves() -> None:
    """A wheel that does not slip turns so that its lowest point, fixed to it, is at rest."""
    robot = Robot(track_width=TRACK, wheel_radius=RADIUS)
    angles = wheel_angles(PLANAR, TURNING, robot)
    for side, angle in zip((1.0, -1.0), angles.T, strict=True):
        hub = position(np.array([0.0, side * 0.5 * TRACK, 0.0]))
        velocity = np.gradient(hub, STEP, axis=0)
        wheel = rotations() * Rotation.from_euler("y", angle[:, None])
        turned = (wheel[:-2].inv() * wheel[2:]).as_rotvec() / (2.0 * STEP)
        spin = wheel[1:-1].apply(turned)
        axle = Rotation.from_euler("ZX", np.column_stack([YAW, ROLL]))[1:-1]
        down = axle.apply([0.0, 0.0, -RADIUS])
        contact = velocity[1:-1] + np.cross(spin, down)
        forward = np.sum(contact * axle.apply([1.0, 0.0, 0.0]), axis=1)
        np.testing.assert_allclose(forward[2:-2], 0.0, atol=2e-5)


def test_the_tilt_is_that_of_the_messages() -> None:
    x, y, z, w = rotations().as_quat().T
    np.testing.assert_allclose(tilt_of_quaternion(x, y, z, w), TILT, atol=1e-12)
    np.testing.assert_allclose(attitudes(YAW, ROLL, TILT), rotations().as_matrix(), atol=1e-12)


@pytest.fixture(scope="module")
def drive() -> Simulated:
    return simulate("W4", 0.002, 60.0, 101)


def test_w4_turns_and_rolls_as_it_says(drive: Simulated) -> None:
    gyro = np.degrees(drive.recording.imu.gyro - drive.setup.calibration.gyro_bias)
    assert 100.0 < np.max(np.abs(gyro[:, 2])) < math.degrees(4.0)
    assert 20.0 < np.max(np.abs(gyro[:, 0])) < 150.0
    difference = np.diff(np.diff(drive.recording.wheels.angle, axis=1)[:, 0])
    turned = np.sum(difference) * 0.0375 / 0.16
    counted = np.sum(np.radians(gyro[:, 2])) * 0.002 / 0.945
    assert drive.setup.robot.track_width == 0.16
    assert turned == pytest.approx(counted, abs=1.0)


def test_w4_is_w2_in_three_dimensions(drive: Simulated) -> None:
    planar = simulate("W2", 0.002, 60.0, 101)
    np.testing.assert_array_equal(drive.recording.truth.tilt, planar.recording.truth.tilt)
    told, true = drive.setup.robot, drive.true_setup.robot
    assert abs(true.lever_arm[1]) == 0.01 and told.lever_arm[1] == 0.0
    assert true.wheel_radius == planar.true_setup.robot.wheel_radius


def test_w4_without_turns_is_w2(drive: Simulated) -> None:
    calm = replace(
        W4,
        yaw_rate=0.0,
        roll_deg=0.0,
        lateral_arm_error=0.0,
        gyro_cross_axis=0.0,
        slips_per_second=0.0,
    )
    spatial = simulate(calm, 0.005, 10.0, 5).recording
    planar = simulate(replace(W2, slips_per_second=0.0), 0.005, 10.0, 5).recording
    np.testing.assert_allclose(spatial.imu.gyro, planar.imu.gyro, atol=2e-4)
    np.testing.assert_allclose(spatial.imu.accel, planar.imu.accel, atol=1e-3)
    step = 2.0 * math.pi / 1320
    np.testing.assert_allclose(spatial.wheels.angle[:, :1], planar.wheels.angle, atol=1.01 * step)


def test_the_seed_decides_everything_in_w4() -> None:
    first, again, other = (simulate("W4", 0.01, 4.0, seed).recording for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.imu.gyro, again.imu.gyro)
    np.testing.assert_array_equal(first.wheels.angle, again.wheels.angle)
    assert not np.array_equal(first.wheels.angle, other.wheels.angle)
    longer = simulate("W4", 0.01, 6.0, 3).recording
    np.testing.assert_array_equal(first.imu.accel, longer.imu.accel[:400])


def test_wheels_slip_one_by_one() -> None:
    rolling = simulate(replace(W4, slips_per_second=0.0), 0.01, 30.0, 2).recording
    slipping = simulate(W4, 0.01, 30.0, 2).recording
    np.testing.assert_array_equal(slipping.imu.gyro, rolling.imu.gyro)
    slip = (slipping.wheels.angle - rolling.wheels.angle) * 0.0375
    assert np.all(np.max(np.abs(slip), axis=0) > 0.001)
    assert np.max(np.abs(slip[:, 0] - slip[:, 1])) > 0.001


@pytest.mark.parametrize("scene", ["still", "poses"])
def test_w4_does_not_turn_in_the_other_scenes(scene: str) -> None:
    recording = simulate("W4", 0.01, 20.0, 1, scene).recording
    angle = recording.wheels.angle
    assert angle.shape[1] == 2
    np.testing.assert_allclose(angle[:, 0], angle[:, 1], atol=1.01 * 2.0 * math.pi / 1320)
