"""A whole simulated recording, with the truth and the robot's description."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ConfigurationError
from ..parameters.argument_checks import number_within, require_kind, shown, whole_number
from ..pipeline.saturation import SATURATION_MARGIN
from ..recording import Event, FloatArray, ImuTrack, Recording, StampArray, TiltTrack, WheelTrack
from ..robot import Robot, Setup
from ..samples import RESTART_GAP
from .disturbances import STEP, gyro_drift, stream
from .kernels import measure, measure_input
from .planar_sensing import PlanarMotion, gyro_cross, imu_errors, mount_of, quantised
from .scenes import SCENES, Performed
from .spatial_sensing import imu_input, in_sensor_axes, wheel_angles
from .turning import straight
from .worlds import World, world_named

if TYPE_CHECKING:
    from ..drives import Drive

WHEEL_COUNTS = 1320
"""Counts of the wheel encoder in one turn of the wheel."""
LONGEST = 36_000.0
"""Longest simulation [s]."""
LARGEST_SEED = 2**63 - 1
FIRST_STAMP = 1_000_000_000
"""Stamp of the first sample [ns]."""


@dataclass(frozen=True, slots=True)
class Simulated:
    """A simulated recording and what it was made of."""

    recording: Recording
    setup: Setup
    """Robot and calibration as the estimator gets them."""
    true_setup: Setup
    """Robot and calibration as they are; `gyro_scale` undoes the gyro's scale error."""
    world: World
    scene: str
    seed: int
    falls: int
    """Number of falls to the stops."""
    saturated: float
    """Share of the samples with a saturated gyro axis."""
    events: tuple[Event, ...] = ()
    """Events of the robot, where the scene defines them."""

    @property
    def drive(self) -> Drive:
        """The recording, with the setup that the estimator gets."""
        from ..drives import Drive  # which a node that simulates has no use for

        return Drive(self.recording, self.setup)


def simulate(
    world: World | str, dt: float, duration: float, seed: int, scene: str = "drive"
) -> Simulated:
    """Simulate one recording; the same arguments give the same recording.

    Args:
        world: one of `WORLDS`, or its name.
        dt: sampling period [s], a multiple of `STEP`.
        duration: length [s].
        seed: number of the random draw.
        scene: one of `SCENES`.

    Raises:
        ConfigurationError: unknown world or scene, or a time that cannot be simulated.
    """
    require_kind("world", world, (str, World), "the name of a world or a World")
    chosen = world_named(world) if isinstance(world, str) else world
    every, samples = sampling(dt, duration)
    seed = require_seed(seed)
    if not isinstance(scene, str) or scene not in SCENES:
        raise ConfigurationError(
            f"`scene`: there is no scene {shown(scene)}; there are: {', '.join(SCENES)}"
        )
    setup, true_setup = setups_of(chosen, seed)
    plant = true_setup.robot.plant()
    performed = SCENES[scene](chosen, plant, (samples - 1) * every + 1, seed)
    imu = _imu(performed, chosen, true_setup, every, samples, seed)
    source = f"simulation: world {chosen.name}, scene {scene}, dt {dt:g} s, seed {seed}"
    recording = _recording(source, performed, imu, chosen, true_setup.robot, every, seed)
    full = np.abs(imu.gyro) >= SATURATION_MARGIN * setup.robot.gyro_range
    saturated = float(np.mean(np.any(full, axis=1)))
    return Simulated(recording, setup, true_setup, chosen, scene, seed, performed.falls, saturated)


def sampling(dt: float, duration: float, step: float = STEP) -> tuple[int, int]:
    """Return the steps between two samples and the number of samples.

    Args:
        dt: sampling period [s].
        duration: length [s].
        step: step of the simulation [s].

    Raises:
        ConfigurationError: a time that cannot be simulated.
    """
    dt = number_within("dt", dt, 0.0, RESTART_GAP, "s")
    duration = number_within("duration", duration, 0.0, LONGEST, "s")
    every = round(dt / step)
    if every < 1 or abs(every * step - dt) > 1e-9:
        raise ConfigurationError(f"`dt`: {dt:g} s is not a multiple of the step {step:g} s")
    samples = math.floor(duration / dt + 1e-6)
    if samples < 2:
        raise ConfigurationError(f"`duration`: {duration:g} s is below two periods of {dt:g} s")
    return every, samples


def require_seed(seed: int) -> int:
    """Return the number of a random draw as an int.

    Raises:
        ConfigurationError: no whole number, or below 0.
    """
    return whole_number("seed", seed, 0, LARGEST_SEED)


def setups_of(world: World, seed: int, robot: Robot | None = None) -> tuple[Setup, Setup]:
    """Return the setup that the estimator gets, and the true one; signs vary by seed."""
    signs = stream(seed, "geometry").choice([-1.0, 1.0], 4).tolist()
    usual = Robot(lever_arm=(0.0, 0.0, world.lever_arm))
    assumed = replace(robot or usual, track_width=world.track_width, gyro_delay=world.gyro_lag)
    arm = assumed.lever_arm
    true = replace(
        assumed,
        wheel_radius=assumed.wheel_radius * (1.0 + signs[0] * world.wheel_radius_error),
        lever_arm=(
            arm[0],
            arm[1] + signs[3] * world.lateral_arm_error,
            arm[2] + signs[1] * world.lever_arm_error,
        ),
        mounting=(
            assumed.mounting[0],
            assumed.mounting[1] + signs[2] * math.radians(world.mounting_error_deg),
            assumed.mounting[2],
        ),
    )
    inverse = 1.0 / (1.0 + world.gyro_scale_error)
    calibration = replace(world.calibration, gyro_scale=(inverse, inverse, inverse))
    return Setup(assumed, world.calibration), Setup(true, calibration)


def _imu(
    performed: Performed, world: World, true: Setup, every: int, samples: int, seed: int
) -> ImuTrack:
    """Return what the IMU reads."""
    noise = stream(seed, "noise").standard_normal((samples, 6))
    drift = gyro_drift(world, samples, every * STEP, seed)
    errors = imu_errors(world, world.calibration, seed, true.robot)
    mount = mount_of(true.robot, world)
    if world.track_width == 0.0:
        readings = measure(performed.motion, mount, errors, drift, noise, every)
    else:
        turns = performed.turning or straight(performed.motion.shape[0])
        body = imu_input(performed.motion, turns, true.robot.lever_arm)
        sensor = in_sensor_axes(body, true.robot.rotation(), gyro_cross(world, seed))
        readings = measure_input(sensor, mount, errors, drift, noise, every)
    return ImuTrack(_stamps(samples, every), readings[:, :3].copy(), readings[:, 3:].copy())


def _stamps(samples: int, every: int) -> StampArray:
    return FIRST_STAMP + np.arange(samples, dtype=np.int64) * round(every * STEP * 1e9)


def _recording(
    source: str,
    performed: Performed,
    imu: ImuTrack,
    world: World,
    robot: Robot,
    every: int,
    seed: int,
) -> Recording:
    """Return the IMU together with encoders and truth at the same stamps."""
    sampled = performed.motion[::every]
    tilt = sampled[:, 1].copy()
    wheels = _wheels(performed, robot)[::every]
    reference = tilt
    if world.digital:
        zeros = stream(seed, "encoders").uniform(0.0, 1.0, wheels.shape[1])
        wheels = quantised(wheels, WHEEL_COUNTS, zeros)
        reference = quantised(tilt, world.reference_counts, 0.5)
    seldom = max(round(world.reference_period / (every * STEP)), 1)
    return Recording(
        source=source,
        imu=imu,
        wheels=WheelTrack(imu.stamps, wheels) if performed.wheels else None,
        reference=TiltTrack(imu.stamps[::seldom].copy(), reference[::seldom].copy()),
        truth=TiltTrack(imu.stamps, tilt, sampled[:, 2].copy()),
    )


def _wheels(performed: Performed, robot: Robot) -> FloatArray:
    """Return the true angles of the wheels against the body, one row a step: (n, 1) or (n, 2)."""
    motion = performed.motion
    if robot.track_width > 0.0:
        return wheel_angles(motion, performed.turning or straight(motion.shape[0]), robot)
    travel = motion[:, PlanarMotion._fields.index("wheel_travel")]
    angle: FloatArray = (travel / robot.wheel_radius - motion[:, 1])[:, None]
    return angle
