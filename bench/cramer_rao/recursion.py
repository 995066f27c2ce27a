"""The posterior Cramer-Rao bound: how well any filter or smoother can do.

Tichavsky, Muravchik, Nehorai 1998, Posterior Cramer-Rao bounds for discrete-time nonlinear
filtering. For additive Gaussian noise the recursion of the information,

    J(k+1) = [Q + F J(k)^-1 F']^-1 + H' R^-1 H,

takes its slopes F and H along the true states. Smoothing has a bound of the same kind, the
blocks on the diagonal of the inverse information of all states, by a backward recursion.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from twbr_estimation.recording import FloatArray


class Jacobians(NamedTuple):
    """One step of a system of s states, measured m times."""

    f: FloatArray
    """Of the new state by the old one, (s, s)."""
    q: FloatArray
    """Covariance of what the step adds, (s, s); may be singular."""
    h: FloatArray
    """Of the measurements by the new state, (m, s)."""
    r: FloatArray
    """Variances of the measurements, (m,)."""


class CramerRao(NamedTuple):
    """Smallest variance of one state, by step, n steps."""

    causal: FloatArray
    """From all measurements so far, (n,)."""
    hindsight: FloatArray
    """From all measurements, (n,)."""


def cramer_rao_of(first: FloatArray, steps: Iterable[Jacobians], state: int = 0) -> CramerRao:
    """Return the bounds of one state.

    Args:
        first: covariance of what is known at the start, (s, s).
        steps: slopes along the true states.
        state: its index.
    """
    p, kept = first, []
    for step in steps:
        prior = step.f @ p @ step.f.T + step.q
        posterior = _measured(prior, step.h, step.r)
        kept.append((_share(p, step.f, prior), prior, posterior))
        p = posterior
    causal = np.array([posterior[state, state] for _, _, posterior in kept])
    hindsight = causal.copy()
    later = p
    for k in range(len(kept) - 1, 0, -1):
        share, prior, _ = kept[k]
        later = kept[k - 1][2] + share @ (later - prior) @ share.T
        hindsight[k - 1] = later[state, state]
    return CramerRao(causal, hindsight)


def _measured(p: FloatArray, h: FloatArray, r: FloatArray) -> FloatArray:
    """Return (P^-1 + H' R^-1 H)^-1, one measurement after the other."""
    for row, variance in zip(h, r, strict=True):
        spread = p @ row
        gain = spread / (row @ spread + variance)
        # Joseph's form: with information far beyond the prior's the short one loses its digits.
        left = np.eye(p.shape[0]) - np.outer(gain, row)
        p = left @ p @ left.T + variance * np.outer(gain, gain)
    return p


def _share(p: FloatArray, f: FloatArray, prior: FloatArray) -> FloatArray:
    """Return P F' (F P F' + Q)^-1; states without any variance take no part."""
    variance = np.diagonal(prior)
    scale = np.where(variance > 0.0, 1.0 / np.sqrt(np.where(variance > 0.0, variance, 1.0)), 0.0)
    scaled = prior * scale[:, None] * scale
    np.fill_diagonal(scaled, 1.0 + 1e-12)
    share = np.linalg.solve(scaled, scale[:, None] * (f @ p)).T * scale
    return np.asarray(share, dtype=np.float64)
