"""The planar model of Sun 2014, eqs (28)-(33): a force drives the wheels, the body is a rod.

Its tilt is positive leaning *backward*, opposite to the rest of this package, because the
gains printed in the paper belong to that sign. Printed, A1 mixes a mass with a weight, B2 does
not follow from its own formula, and (28) lacks the centrifugal term; `linearised` and
`accelerations` are right, `PRINTED` keeps what the paper's gains were computed from.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


class RodParameters(NamedTuple):
    """Masses and lengths, Sun 2014 Table II."""

    body_mass: float = 0.5
    """m_b [kg]."""
    wheel_mass: float = 0.05
    """m_w, of one wheel; its inertia is neglected [kg]."""
    height: float = 0.28
    """L, axle to centre of mass [m]."""
    gravity: float = 9.8
    """g [m/s^2]."""


class RodState(NamedTuple):
    """The state of (32)."""

    tilt: float
    """phi [rad], positive backward."""
    rate: float
    """Its rate [rad/s]."""
    position: float
    """x [m], positive forward."""
    velocity: float
    """Its rate [m/s]."""


class Coefficients(NamedTuple):
    """The numbers of (32)."""

    a1: float
    a2: float
    b1: float
    b2: float


PRINTED = Coefficients(a1=115.5, a2=16.333, b1=11.905, b2=4.447)
"""As printed; the printed gains follow from these, but the robot does not move so."""


def coefficients(parameters: RodParameters) -> Coefficients:
    """Return the coefficients of (32) in their right form."""
    m, w, length, g = parameters
    inertia = m * length * length / 3.0
    total = 2.0 * w + m
    denominator = inertia * total + 2.0 * w * m * length * length
    return Coefficients(
        a1=total * m * g * length / denominator,
        a2=m * m * g * length * length / denominator,
        b1=m * length / denominator,
        b2=(m * length * length + inertia) / denominator,
    )


def matrices(numbers: Coefficients) -> tuple[Matrix, Matrix]:
    """Return A (4, 4) and B (4, 1) of (32); state as in `RodState`, input the force [N]."""
    a, b = np.zeros((4, 4)), np.zeros((4, 1))
    a[0, 1] = a[2, 3] = 1.0
    a[1, 0], a[3, 0] = numbers.a1, numbers.a2
    b[1, 0], b[3, 0] = numbers.b1, numbers.b2
    return a, b


def accelerations(state: RodState, force: float, parameters: RodParameters) -> tuple[float, float]:
    """Return angular [rad/s^2] and linear [m/s^2] acceleration, (28) and (29) solved for both.

    (28) is completed by m_b L phi'^2 sin(phi).
    """
    m, w, length, g = parameters
    inertia, total = 4.0 / 3.0 * m * length * length, 2.0 * w + m
    sine, coupling = math.sin(state.tilt), m * length * math.cos(state.tilt)
    driving = force - m * length * state.rate * state.rate * sine
    turning = m * g * length * sine
    determinant = inertia * total - coupling * coupling
    angular = (total * turning + coupling * driving) / determinant
    linear = (coupling * turning + inertia * driving) / determinant
    return angular, linear
