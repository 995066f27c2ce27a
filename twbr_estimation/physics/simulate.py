"""A whole recording of a scene in MuJoCo, as `simulation.simulate` makes one of the rig."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..parameters.argument_checks import number_within
from ..recording import Event, FloatArray, ImuTrack, Recording, TiltTrack, WheelTrack
from ..robot import Robot
from ..samples import RESTART_GAP
from ..simulation.disturbances import STEP, gyro_drift, stream
from ..simulation.kernels import measure_input
from ..simulation.planar_sensing import imu_errors, mount_of, quantised
from ..simulation.simulate import (
    FIRST_STAMP,
    WHEEL_COUNTS,
    Simulated,
    require_seed,
    sampling,
    setups_of,
)
from ..simulation.worlds import World, world_named
from .model import track_width
from .performance import Performance, performed
from .sensing import repeated, senses_of, shaking
from .state import tilts

COARSE_STEP = 0.001
"""Step of the integration [s] where the sampling period is a multiple of it, else `STEP`."""
USUAL_DURATION = 20.0
"""Length of a scene [s]."""


def simulate(
    scene: str,
    dt: float = 0.002,
    duration: float = USUAL_DURATION,
    seed: int = 1,
    *,
    world: World | str = "paper",
    robot: Robot | None = None,
    clipped_first: bool = False,
) -> Simulated:
    """Simulate one scene; the same arguments give the same recording.

    Args:
        scene: one of `SCENES`.
        dt: sampling period [s], a multiple of `STEP`.
        duration: length [s].
        seed: number of the random draw.
        world: what is wrong with sensors and geometry; its ground and pushes are the scene's.
        robot: the robot's parameters as the estimator gets them; the defaults where None.
        clipped_first: whether the IMU clips before its low-pass, as the chip may.

    Raises:
        ConfigurationError: MuJoCo is missing, an unknown scene or world, or a time that cannot
            be simulated.
    """
    seed = require_seed(seed)
    assumed = robot or Robot()
    chosen = spatial(world_named(world) if isinstance(world, str) else world, assumed)
    setup, true_setup = setups_of(chosen, seed, assumed)
    step, every, samples = steps_of(dt, duration)
    count = (samples - 1) * every
    rows, volts, performance = performed(scene, true_setup.robot, seed, step, count)
    imu = _imu(rows, volts, chosen, true_setup.robot, step, samples, every, seed, clipped_first)
    source = f"simulation: MuJoCo, scene {scene}, world {chosen.name}, dt {dt:g} s, seed {seed}"
    recording = _recording(source, rows[::every], imu, chosen, true_setup.robot, seed)
    full = np.abs(imu.gyro) >= 0.999 * setup.robot.gyro_range
    return Simulated(
        recording,
        setup,
        true_setup,
        chosen,
        scene,
        seed,
        performance.stage.falls,
        float(np.mean(np.any(full, axis=1))),
        _events(performance, int(imu.stamps[-1])),
    )


def spatial(world: World, robot: Robot) -> World:
    """Return a world for a robot with two wheels."""
    return replace(world, track_width=track_width(robot))


def steps_of(dt: float, duration: float) -> tuple[float, int, int]:
    """Return the step of the integration [s], the steps a sample and the number of samples.

    Raises:
        ConfigurationError: a time that cannot be simulated.
    """
    dt = number_within("dt", dt, 0.0, RESTART_GAP, "s")
    coarse = abs(dt / COARSE_STEP - round(dt / COARSE_STEP)) < 1e-6 and dt >= COARSE_STEP
    step = COARSE_STEP if coarse else STEP
    return step, *sampling(dt, duration, step)


def _imu(
    rows: FloatArray,
    volts: FloatArray,
    world: World,
    robot: Robot,
    step: float,
    samples: int,
    every: int,
    seed: int,
    clipped_first: bool,
) -> ImuTrack:
    """Return what the IMU reads."""
    times = round(step / STEP)
    speed = np.repeat(np.hypot(rows[1:, 9], rows[1:, 10]), times)
    shake = shaking(world, speed, np.repeat(volts, times), seed)
    shake = shake.reshape(-1, times, 3).mean(axis=1)
    senses = senses_of(robot, world, seed, clipped_first=clipped_first)
    fine = repeated(senses.imu_input(rows, step, shake), step)
    first = type(fine)(*(np.vstack([part[:1], part]) for part in fine))
    noise = stream(seed, "noise").standard_normal((samples, 6))
    drift = gyro_drift(world, samples, every * step, seed)
    errors = imu_errors(world, world.calibration, seed, robot)
    readings = measure_input(first, mount_of(robot, world), errors, drift, noise, every * times)
    stamps = FIRST_STAMP + np.arange(samples, dtype=np.int64) * round(every * step * 1e9)
    return ImuTrack(stamps, readings[:, :3].copy(), readings[:, 3:].copy())


def _recording(
    source: str, rows: FloatArray, imu: ImuTrack, world: World, robot: Robot, seed: int
) -> Recording:
    """Return the IMU together with encoders and truth at the same stamps."""
    tilt, rate = tilts(rows)
    wheels = senses_of(robot, world, seed).wheels(rows)
    reference = tilt
    if world.digital:
        zeros = stream(seed, "encoders").uniform(0.0, 1.0, 2)
        wheels = quantised(wheels, WHEEL_COUNTS, zeros)
        reference = quantised(tilt, world.reference_counts, 0.5)
    return Recording(
        source=source,
        imu=imu,
        wheels=WheelTrack(imu.stamps, wheels),
        reference=TiltTrack(imu.stamps, reference),
        truth=TiltTrack(imu.stamps, tilt, rate),
    )


def _events(performance: Performance, last: int) -> tuple[Event, ...]:
    """Return what happened up to the last stamp [ns]."""
    found = performance.stage.diary.events(performance.stage.stamp)
    shifted = (e._replace(begin=e.begin + FIRST_STAMP, end=e.end + FIRST_STAMP) for e in found)
    return tuple(e._replace(end=min(e.end, last)) for e in shifted if e.begin < last)
