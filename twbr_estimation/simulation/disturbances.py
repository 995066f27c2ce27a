"""What shakes, pushes and commands the robot, drawn beforehand as one row per step.

Each kind of disturbance has a random stream of its own, so that changing one leaves the
others as they were.
"""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass

import numpy as np

from ..recording import FloatArray
from .worlds import World

STEP = 0.0005
"""Integration step of the plant [s]."""
PUSH_RATE = 0.63
"""Pushes [1/s], half sines on the body."""
PUSH_SECONDS = (0.08, 0.35)
PUSH_FORCE = 5.5
"""Largest push [N]."""
HIT_RATE = 0.042
"""Obstacles met by the wheels [1/s]."""
SLOPE = 0.03
"""Largest slope of the ground, rise over run."""
STEP_DISTANCE = 0.56
"""Largest commanded move [m]."""
SINE_FREQUENCIES = (0.5, 1.6)
"""Commanded to-and-fro motion [Hz]."""
TASK_SECONDS = (1.5, 5.0)
BUMP_CUTOFF = 25.0
"""Bandwidth of road bumps [Hz]."""
VIBRATION_FREQUENCIES = (42.0, 115.0)
"""Resonances of the frame [Hz]."""
VIBRATION_DAMPING = 0.05
SLIP_SECONDS = (0.05, 0.2)
SLIP_SPEED = 0.3
"""Fastest slip of the tread over the ground [m/s]."""
DRIFT_SECONDS = 100.0
"""Correlation time of the gyro bias drift [s]."""


@dataclass(frozen=True, slots=True)
class Disturbances:
    """Inputs of the rig, one row a step of `STEP`; n steps."""

    push: FloatArray
    """Force on the body [N], (n,)."""
    slope: FloatArray
    """Slope of the ground, rising forward, (n,)."""
    hit: FloatArray
    """1 where an obstacle comes up, (n,)."""
    target: FloatArray
    """Commanded position [m], (n,)."""
    bump: FloatArray
    """Vertical road acceleration at unit level, (n,)."""
    vibration: FloatArray
    """Frame vibration at unit level, forward, left, up, (n, 3)."""
    slip: FloatArray
    """Speed of the tread over the ground [m/s], (n,)."""


def stream(seed: int, purpose: str) -> np.random.Generator:
    """Return the random stream of one purpose."""
    return np.random.default_rng([seed, zlib.crc32(purpose.encode())])


def disturb(world: World, steps: int, seed: int) -> Disturbances:
    """Draw all disturbances of a drive of `steps` steps."""
    rough = world.vibration
    return Disturbances(
        push=world.push_factor
        * _half_sines(stream(seed, "push"), steps, PUSH_RATE, PUSH_SECONDS)
        * PUSH_FORCE,
        slope=rough * _slope(stream(seed, "slope"), steps),
        hit=_events(stream(seed, "hit"), steps, HIT_RATE if world.impacts else 0.0),
        target=world.push_factor * _tasks(stream(seed, "target"), steps),
        bump=rough * _bumps(stream(seed, "bump"), steps),
        vibration=rough * _vibration(stream(seed, "vibration"), steps),
        slip=SLIP_SPEED
        * _half_sines(stream(seed, "slip"), steps, world.slips_per_second, SLIP_SECONDS),
    )


def gyro_drift(world: World, samples: int, dt: float, seed: int) -> FloatArray:
    """Return the slow deviation of the three gyro biases [rad/s], (samples, 3)."""
    from scipy.signal import lfilter

    keep = math.exp(-dt / DRIFT_SECONDS)
    white = stream(seed, "drift").standard_normal((samples, 3))
    white[1:] *= math.sqrt(1.0 - keep * keep)
    drift = lfilter([1.0], [1.0, -keep], white, axis=0)
    return np.asarray(math.radians(world.gyro_drift_deg) * drift, dtype=np.float64)


def _events(random: np.random.Generator, steps: int, rate: float) -> FloatArray:
    """Return 1 at the steps of a Poisson process, else 0."""
    return (random.random(steps) < rate * STEP).astype(np.float64)


def _half_sines(
    random: np.random.Generator, steps: int, rate: float, seconds: tuple[float, float]
) -> FloatArray:
    """Return half sines of random length, sign and height up to 1."""
    total = np.zeros(steps)
    for start in np.flatnonzero(_events(random, steps, rate)):
        length = int(random.uniform(*seconds) / STEP)
        height = random.uniform(-1.0, 1.0)
        end = min(start + length, steps)
        total[start:end] += height * np.sin(np.pi * np.arange(end - start) / length)
    return total


def _slope(random: np.random.Generator, steps: int) -> FloatArray:
    """Return a slope that changes smoothly every few seconds."""
    spacing = 2.0
    knots = np.arange(int(steps * STEP / spacing) + 2) * spacing
    values = random.uniform(-SLOPE, SLOPE, knots.size)
    return np.asarray(np.interp(np.arange(steps) * STEP, knots, values))


def _tasks(random: np.random.Generator, steps: int) -> FloatArray:
    """Return position steps and sines in random order, with a quiet first second."""
    target = np.zeros(steps)
    begin, base = int(1.0 / STEP), 0.0
    while begin < steps:
        length = int(random.uniform(*TASK_SECONDS) / STEP)
        end = min(begin + length, steps)
        time = np.arange(end - begin) * STEP
        frequency = random.uniform(*SINE_FREQUENCIES)
        size = random.uniform(-STEP_DISTANCE, STEP_DISTANCE)
        if random.random() < 0.5:
            base = size
            target[begin:end] = base
        else:
            target[begin:end] = base + size * np.sin(2.0 * np.pi * frequency * time)
        begin = end
    return target


def _bumps(random: np.random.Generator, steps: int) -> FloatArray:
    """Return noise of unit rms below `BUMP_CUTOFF`."""
    from scipy.signal import lfilter

    keep = math.exp(-2.0 * math.pi * BUMP_CUTOFF * STEP)
    white = random.standard_normal(steps)
    return np.asarray(lfilter([math.sqrt(1.0 - keep * keep)], [1.0, -keep], white))


def _vibration(random: np.random.Generator, steps: int) -> FloatArray:
    """Return noise through the frame's resonances, unit rms on each axis."""
    from scipy.signal import lfilter

    total = np.zeros((steps, 3))
    for frequency in VIBRATION_FREQUENCIES:
        turn = 2.0 * math.pi * frequency * STEP
        decay = math.exp(-VIBRATION_DAMPING * turn)
        feedback = [1.0, -2.0 * decay * math.cos(turn), decay * decay]
        wave = lfilter([1.0], feedback, random.standard_normal((steps, 3)), axis=0)
        total += wave / np.sqrt(np.mean(wave**2, axis=0))
    return np.asarray(total / math.sqrt(len(VIBRATION_FREQUENCIES)))
