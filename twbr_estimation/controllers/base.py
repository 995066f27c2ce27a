"""Interface of a balance controller: one `Controller` per file, collected by name.

A controller file defines `Parameters` (the settings a user may change), `State` (kept from step to
step, with the voltages it commands), `reset`, `step` and where needed `derive`, and ends with
`CONTROLLER = Controller(...)`. The registry, `twbr balance` and the node read that definition and
nothing else. Steps use scalars and `math` only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

from ..parameters.bounds import Bounds as Bounds
from ..parameters.declared import Definition, collected, listed, named
from ..robot import Robot


class ControlInput(NamedTuple):
    """Input of a controller at one instant; REP-103 signs, tilt positive leaning forward."""

    dt: float
    """Time since the previous step [s]; 0 for the first."""
    tilt: float
    """Tilt [rad]."""
    rate: float
    """Tilt rate [rad/s]."""
    position: float
    """Travel of the axle over the ground [m]; the encoder's turn with the body is out of it."""
    velocity: float
    """Speed of the axle [m/s]."""
    heading: float
    """Heading [rad], not wrapped, positive to the left; 0 on a robot that does not measure it."""
    yaw_rate: float
    """Its rate [rad/s]."""
    target_velocity: float
    """Commanded speed [m/s]."""
    target_yaw_rate: float
    """Commanded yaw rate [rad/s]."""


class MotorVoltages(NamedTuple):
    """Voltages of the motors until the next step [V]; positive drives forward."""

    left: float
    right: float


@dataclass(frozen=True, slots=True, eq=False)
class Controller(Definition):
    """The complete definition of a controller; everything else is derived from it."""

    state: type[Any]
    """Named tuple with the fields `left` and `right`, the voltages asked for [V]."""
    reset: Callable[[ControlInput, Any], Any]
    """reset(input, coefficients): the state to begin with; stand where the robot is now."""
    step: Callable[[Any, ControlInput, Any], Any]
    """step(state, input, coefficients): the state one period later; dt is above 0."""
    derive: Callable[[Any, Robot, float], Any]
    """derive(parameters, robot, period): the coefficients, computed once; period in [s]."""

    def coefficients(self, parameters: Any, robot: Robot, period: float) -> Any:
        """Return what `derive` gives, from memory where it was asked before: it may take long.

        Raises:
            ConfigurationError: what `derive` cannot do.
        """
        return _coefficients(self, parameters, robot, period)


@lru_cache(maxsize=64)
def _coefficients(entry: Controller, parameters: Any, robot: Robot, period: float) -> Any:
    return entry.derive(parameters, robot, period)


@lru_cache(maxsize=1)
def controllers() -> Mapping[str, Controller]:
    """Return every controller of this folder by name, in alphabetical order."""
    return collected(__name__.rpartition(".")[0], "CONTROLLER")


def listed_controllers() -> Mapping[str, Controller]:
    """Return the controllers a user chooses among: all but the historical ones."""
    return listed(controllers())


def controller_named(name: str) -> Controller:
    """Return the controller of that name.

    Raises:
        ConfigurationError: no such controller; the message lists those there are.
    """
    return named(controllers(), name, "controller")
