"""Vibration, pushes and commands of the robot, drawn in advance as one row per step.

Each kind of disturbance has a separate random stream: a change of one leaves the others
unchanged, and a longer drive begins like a shorter one.
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
WEAKEST = 0.15
"""Smallest push or slip as a share of the largest."""
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
STEP_SHARE = 0.4
"""Share of the tasks that are steps."""
SPEED_SHARE = 0.38
"""Share of a sine's speed that the controller receives."""

TASK_SECONDS = (1.0, 3.0)
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
    target_speed: FloatArray
    """Commanded speed [m/s], (n,)."""
    bump: FloatArray
    """Vertical road acceleration at unit level, (n,)."""
    vibration: FloatArray
    """Frame vibration at unit level, forward, left, up, (n, 3)."""
    slip: FloatArray
    """Speed of the tread over the ground [m/s], (n,)."""

    def inputs(self) -> FloatArray:
        """Return all but the vibration, (n, 7), in the order of `rig.Inputs`."""
        return np.column_stack(
            [
                self.push,
                self.slope,
                self.hit,
                self.target,
                self.target_speed,
                self.bump,
                self.slip,
            ]
        )


def stream(seed: int, purpose: str) -> np.random.Generator:
    """Return the random stream of one purpose."""
    return np.random.default_rng([seed, zlib.crc32(purpose.encode())])


def disturb(world: World, steps: int, seed: int) -> Disturbances:
    """Draw all disturbances of a drive of `steps` steps."""
    rough = world.vibration
    target, target_speed = _tasks(stream(seed, "target"), steps)
    return Disturbances(
        push=world.push_factor
        * half_sines(stream(seed, "push"), steps, PUSH_RATE, PUSH_SECONDS)
        * PUSH_FORCE,
        slope=rough * _slope(stream(seed, "slope"), steps),
        hit=_events(stream(seed, "hit"), steps, HIT_RATE if world.impacts else 0.0),
        target=world.push_factor * smoothed(target, world.command_smoothing),
        target_speed=world.push_factor * smoothed(target_speed, world.command_smoothing),
        bump=rough * _bumps(stream(seed, "bump"), steps),
        vibration=rough * vibration(stream(seed, "vibration"), steps),
        slip=SLIP_SPEED
        * half_sines(stream(seed, "slip"), steps, world.slips_per_second, SLIP_SECONDS),
    )


def gyro_drift(world: World, samples: int, dt: float, seed: int) -> FloatArray:
    """Return the slow deviation of the three gyro biases [rad/s], (samples, 3)."""
    from scipy.signal import lfilter

    keep = math.exp(-dt / DRIFT_SECONDS)
    white = stream(seed, "drift").standard_normal((samples, 3))
    white[1:] *= math.sqrt(1.0 - keep * keep)
    drift = lfilter([1.0], [1.0, -keep], white, axis=0)
    return np.asarray(math.radians(world.gyro_drift_deg) * drift, dtype=np.float64)


def half_sines(
    random: np.random.Generator, steps: int, rate: float, seconds: tuple[float, float]
) -> FloatArray:
    """Return half sines of random length, sign and height, `WEAKEST` to 1."""
    total = np.zeros(steps)
    start = 0.0
    while rate > 0.0:
        start += random.exponential(1.0 / rate) / STEP
        length = int(random.uniform(*seconds) / STEP)
        height = random.uniform(WEAKEST, 1.0) * random.choice([-1.0, 1.0])
        if start >= steps:
            break
        begin, end = int(start), min(int(start) + length, steps)
        total[begin:end] += height * np.sin(np.pi * np.arange(end - begin) / length)
    return total


def _events(random: np.random.Generator, steps: int, rate: float) -> FloatArray:
    """Return 1 at the steps of a Poisson process of `rate` [1/s], else 0."""
    happens = np.zeros(steps)
    step = 0.0
    while rate > 0.0:
        step += random.exponential(1.0 / rate) / STEP
        if step >= steps:
            break
        happens[int(step)] = 1.0
    return happens


def _slope(random: np.random.Generator, steps: int) -> FloatArray:
    """Return a slope that changes smoothly every few seconds."""
    spacing = 2.0
    knots = np.arange(int(steps * STEP / spacing) + 2) * spacing
    values = random.uniform(-SLOPE, SLOPE, knots.size)
    return np.asarray(np.interp(np.arange(steps) * STEP, knots, values))


def _tasks(random: np.random.Generator, steps: int) -> tuple[FloatArray, FloatArray]:
    """Return positions and speeds of steps and sines, with a quiet first second.

    The faster a sine, the shorter its travel.
    """
    position, speed = np.zeros(steps), np.zeros(steps)
    begin, base = int(1.0 / STEP), 0.0
    while begin < steps:
        end = min(begin + int(random.uniform(*TASK_SECONDS) / STEP), steps)
        frequency = random.uniform(*SINE_FREQUENCIES)
        size = random.uniform(-STEP_DISTANCE, STEP_DISTANCE)
        if random.random() < STEP_SHARE:
            base = size
            position[begin:end] = base
        else:
            turn = 2.0 * math.pi * frequency
            phase = turn * STEP * np.arange(end - begin)
            size *= SINE_FREQUENCIES[0] / frequency
            position[begin:end] = base + size * np.sin(phase)
            speed[begin:end] = SPEED_SHARE * size * turn * np.cos(phase)
        begin = end
    return position, speed


def smoothed(command: FloatArray, seconds: float) -> FloatArray:
    """Return the command averaged twice over the past `seconds`, which takes its corners."""
    window = round(seconds / STEP)
    for _ in range(2 if window > 1 else 0):
        total = np.cumsum(np.concatenate([np.zeros(window), command]))
        command = (total[window:] - total[:-window]) / window
    return command


def _bumps(random: np.random.Generator, steps: int) -> FloatArray:
    """Return noise of unit rms below `BUMP_CUTOFF`."""
    from scipy.signal import lfilter

    keep = math.exp(-2.0 * math.pi * BUMP_CUTOFF * STEP)
    white = random.standard_normal(steps)
    return np.asarray(lfilter([math.sqrt(1.0 - keep * keep)], [1.0, -keep], white))


def vibration(random: np.random.Generator, steps: int) -> FloatArray:
    """Return noise through the frame's resonances, unit rms on each axis."""
    from scipy.signal import lfilter

    total = np.zeros((steps, 3))
    white = random.standard_normal((steps, len(VIBRATION_FREQUENCIES), 3))
    for index, frequency in enumerate(VIBRATION_FREQUENCIES):
        turn = 2.0 * math.pi * frequency * STEP
        decay = math.exp(-VIBRATION_DAMPING * turn)
        first, second = -2.0 * decay * math.cos(turn), decay * decay
        # Variance of the filter's output for white noise of variance 1.
        variance = (1.0 + second) / ((1.0 - second) * ((1.0 + second) ** 2 - first**2))
        wave = lfilter([1.0], [1.0, first, second], white[:, index], axis=0)
        total += wave / math.sqrt(variance * len(VIBRATION_FREQUENCIES))
    return total
