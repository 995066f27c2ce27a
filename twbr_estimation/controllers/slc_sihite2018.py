"""Successive loop closure and the yaw controller of Sihite 2018, (33)-(35).

The inner loop D1 turns the tilt's error into the motors' command, the outer one D2 turns the
wheels' into the tilt to hold. As printed, (34) has numerators that add up to -0.001 beside an
integrator, which is an artefact of three decimals: with it the loop around the paper's own
robot diverges slowly. Here its last coefficient is -0.183, which puts the zero on the integrator,
and the two cancel: D2 = -0.189 (z - 0.968) / (z - 0.86), a lead, fed with the deviation of
the wheels from their target.

D1 and D2 belong to 200 Hz; for another period they are carried over by the bilinear rule. The
command u_x of the paper's robot is turned into a voltage of the user's by what both do to the
tilt, and the stronger back-EMF of the user's motors is made up for.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from ..plants.laddach2022 import linearised
from ..robot import Robot
from .base import Bounds, ControlInput, Controller
from .state_feedback import rolling_voltage
from .steering import Target, YawGain, YawRateGain, clamped, here, moved, split, turning_voltage

PRINTED_PERIOD = 0.005
"""Period that (33), (34) belong to [s]."""
INNER = ((-4.95, 8.86, -3.97), (1.0, -1.48, 0.481))
"""D1 of (33): numerator and denominator, z^2 first."""
OUTER = ((-0.189, 0.372, -0.183), (1.0, -1.86, 0.86))
"""D2 of (34), its zero on its integrator."""
EDUMIP_TILT = 544.66
"""Angular acceleration of the paper's robot per u_x, 2.7233 / 0.005 s of (46) [rad/s^2]."""

Quadratic = tuple[float, float, float]


class Parameters(NamedTuple):
    """Scale of the loop gains on the user's robot, and the gains of the heading."""

    inner_gain: Annotated[float, Bounds(0.05, 20.0, "1", "Factor on D1")] = 5.0
    outer_gain: Annotated[float, Bounds(0.0, 20.0, "1", "Factor on D2")] = 0.8
    damping: Annotated[
        float, Bounds(0.0, 1.0, "1", "Share of the motors' back-EMF that is made up for")
    ] = 0.7
    largest_lean: Annotated[
        float, Bounds(0.01, 1.0, "rad", "Largest tilt the outer loop commands")
    ] = 0.3
    yaw_gain: YawGain = 3.0
    yaw_rate_gain: YawRateGain = 0.3


class Second(NamedTuple):
    """A transfer function of second order in z, its denominator starting with 1."""

    numerator: Quadratic
    denominator: Quadratic


class Coefficients(NamedTuple):
    """Constants of a step."""

    inner: Second
    """Tilt error [rad] to voltage [V]."""
    outer: Second
    """Wheel angle ahead of its target [rad] to tilt [rad]."""
    wheel_radius: float
    rolling: float
    """Voltage made up for per rolling speed [V s/m]."""
    command: float
    """The rest of it, for the commanded speed [V s/m]."""
    gains: Parameters
    limit: float


class Memory(NamedTuple):
    """Past of one transfer function: inputs and outputs, the latest first."""

    inputs: tuple[float, float] = (0.0, 0.0)
    outputs: tuple[float, float] = (0.0, 0.0)


class State(NamedTuple):
    """Voltages, target and both loops' past."""

    left: float
    right: float
    target: Target
    inner: Memory
    outer: Memory


def resampled(function: tuple[Quadratic, Quadratic], period: float) -> Second:
    """Return a transfer function of `PRINTED_PERIOD` for another period, by the bilinear rule."""
    share = PRINTED_PERIOD / period
    # z of the printed period is (up z + down) / (down z + up).
    up, down = 1.0 + share, 1.0 - share
    numerator, denominator = (_substituted(each, up, down) for each in function)
    lead = denominator[0]
    return Second(
        (numerator[0] / lead, numerator[1] / lead, numerator[2] / lead),
        (1.0, denominator[1] / lead, denominator[2] / lead),
    )


def _substituted(p: Quadratic, up: float, down: float) -> Quadratic:
    """Return p((up z + down) / (down z + up)) times (down z + up)^2."""
    a, b, c = p
    return (
        a * up * up + b * up * down + c * down * down,
        2.0 * (a + c) * up * down + b * (up * up + down * down),
        a * down * down + b * up * down + c * up * up,
    )


def _scaled(function: Second, gain: float) -> Second:
    n = function.numerator
    return Second((gain * n[0], gain * n[1], gain * n[2]), function.denominator)


def _filtered(memory: Memory, value: float, function: Second, limit: float) -> tuple[float, Memory]:
    """Return the output for one more input, within +-limit, which also stops wind-up."""
    n, d = function
    (u1, u2), (y1, y2) = memory
    output = n[0] * value + n[1] * u1 + n[2] * u2 - d[1] * y1 - d[2] * y2
    output = clamped(output, -limit, limit)
    return output, Memory((value, u1), (output, y1))


def derive(parameters: Parameters, robot: Robot, period: float) -> Coefficients:
    """Return the coefficients."""
    _, b = linearised(robot.plant())
    volts = EDUMIP_TILT / -float(b[3, 0])
    rolling = rolling_voltage(robot)
    return Coefficients(
        _scaled(resampled(INNER, period), parameters.inner_gain * volts),
        _scaled(resampled(OUTER, period), parameters.outer_gain),
        robot.wheel_radius,
        parameters.damping * rolling,
        (1.0 - parameters.damping) * rolling,
        parameters,
        robot.supply_voltage,
    )


def reset(now: ControlInput, c: Coefficients) -> State:
    """Begin where the robot stands, with both loops at rest."""
    del c
    return State(0.0, 0.0, here(now), Memory(), Memory())


def step(state: State, now: ControlInput, c: Coefficients) -> State:
    """Take one step of both loops."""
    target = moved(state.target, now)
    ahead = (now.position - target.position) / c.wheel_radius
    lean, outer = _filtered(state.outer, ahead, c.outer, c.gains.largest_lean)
    asked, inner = _filtered(state.inner, lean - now.tilt, c.inner, c.limit)
    asked += c.rolling * (now.velocity - c.wheel_radius * now.rate)
    asked += c.command * now.target_velocity
    turn = turning_voltage(target, now, c.gains.yaw_gain, c.gains.yaw_rate_gain)
    left, right = split(asked, turn, c.limit)
    return State(left, right, target, inner, outer)


CONTROLLER = Controller(
    name="slc_sihite2018",
    title="Successive loop closure: the wheels' loop sets the tilt, the tilt's the motors.",
    source="Sihite 2018 (33)-(35)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    derive=derive,
)
