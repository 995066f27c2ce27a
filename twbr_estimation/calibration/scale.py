"""Scale polynomials of an accelerometer axis, fitted and compared, Laddach 2022 (52)-(53).

S has no free term: the reading at zero force is the bias. It is fitted as p times a sum of
Chebyshev polynomials over the range of the poses, which stays well-conditioned up to degree
10, and by linear least squares, whose minimum is the only one. The degree is chosen by
cross-validation: how well each one predicts a pose that was left out. The outermost poses are
never left out: beyond them the correction clamps the argument of S, so nothing is extrapolated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from ..recording import FloatArray
from ..robot import POLYNOMIAL_DEGREE


@dataclass(frozen=True, slots=True)
class Degree:
    """Errors of one degree."""

    degree: int
    training: float
    """Mean square error at the poses it was fitted to [(m/s^2)^2]."""
    validation: float
    """Mean square error at poses left out [(m/s^2)^2]."""
    monotonic: bool
    """Whether p - S(p) grows over the whole range; a fold has no inverse."""


@dataclass(frozen=True, slots=True)
class ScaleFit:
    """The chosen polynomial and the candidates."""

    polynomial: tuple[float, ...]
    """Coefficients of p, p^2, ..."""
    valid: tuple[float, float]
    """Range of the poses [m/s^2]."""
    degrees: tuple[Degree, ...]
    reason: str
    """Why this degree."""

    def corrected(self, unbiased: FloatArray) -> FloatArray:
        """Return p - S(p), the argument of S clamped to the valid range, (11)."""
        series = Polynomial([0.0, *self.polynomial])
        scaled: FloatArray = unbiased - series(np.clip(unbiased, *self.valid))
        return scaled


def fit_scale(unbiased: FloatArray, force: FloatArray) -> ScaleFit:
    """Fit every degree, and choose one.

    Of the degrees whose error at unseen poses is, pose by pose, not clearly (by one standard
    error) above that of the best one, the lowest is taken.

    Args:
        unbiased: mean readings of the poses, bias removed [m/s^2], (p,).
        force: what they should read [m/s^2], (p,).
    """
    order = np.argsort(unbiased)
    p, wanted = unbiased[order], force[order]
    degrees, residuals = [], []
    for degree in range(1, min(POLYNOMIAL_DEGREE, p.size - 3) + 1):
        left_out = _left_out(p, wanted, degree)
        series = _fit(p, p - wanted, degree)
        training = float(np.mean(np.square(p - series(p) - wanted)))
        grid = np.linspace(p[0], p[-1], 200)
        monotonic = bool(np.all(np.diff(grid - series(grid)) > 0.0))
        degrees.append(Degree(degree, training, float(np.mean(left_out**2)), monotonic))
        residuals.append(left_out**2)
    chosen, reason = _choose(degrees, residuals)
    coefficients = _fit(p, p - wanted, chosen).coef[1:]
    polynomial = tuple(float(number) for number in coefficients)
    return ScaleFit(polynomial, (float(p[0]), float(p[-1])), tuple(degrees), reason)


def _fit(p: FloatArray, error: FloatArray, degree: int) -> Polynomial:
    """Return the polynomial without free term of least squares, in powers of p."""
    domain = [float(p.min()), float(p.max())]
    mapped = np.polynomial.polyutils.mapdomain(p, domain, [-1.0, 1.0])
    design = p[:, None] * np.polynomial.chebyshev.chebvander(mapped, degree - 1)
    weights = np.linalg.lstsq(design, error, rcond=None)[0]
    factor = Chebyshev(weights, domain=domain).convert(kind=Polynomial).coef
    padded = np.zeros(degree + 1)
    padded[1 : factor.size + 1] = factor
    return Polynomial(padded)


def _left_out(p: FloatArray, wanted: FloatArray, degree: int) -> FloatArray:
    """Return the error at each inner pose of the fit to all others, (p - 2,)."""
    errors = np.empty(p.size - 2)
    for index in range(1, p.size - 1):
        others = np.arange(p.size) != index
        series = _fit(p[others], (p - wanted)[others], degree)
        errors[index - 1] = p[index] - series(p[index]) - wanted[index]
    return errors


def _choose(degrees: list[Degree], squares: list[FloatArray]) -> tuple[int, str]:
    usable = [index for index, each in enumerate(degrees) if each.monotonic] or [0]
    best = min(usable, key=lambda index: degrees[index].validation)
    for index in usable:
        more = squares[index] - squares[best]
        allowed = float(np.std(more)) / np.sqrt(more.size)
        if index == best or float(np.mean(more)) <= allowed:
            break
    chosen, least = degrees[index], degrees[best]
    figures = f"{chosen.validation:.3g} (m/s^2)^2 at unseen poses"
    if index == best:
        return chosen.degree, f"degree {chosen.degree} has the least error, {figures}"
    return chosen.degree, (
        f"degree {chosen.degree} has {figures}, not clearly more than the {least.validation:.3g} "
        f"of degree {least.degree}"
    )
