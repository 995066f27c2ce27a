"""The loops of the smoother over whole recordings, compiled from the single steps."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ..batch.kernels import SOURCES, sample_at
from ..filters.inertial.error_state import STATES, Array
from ..filters.inertial.strapdown import heading_of, matrix_of, product, rotation_of, tilt_of
from ..filters.ins_odometer import tilt_variance
from .backward import BackwardState, step_back
from .forward import advance

_SOURCES = (*SOURCES, "smoothing/*.py")


def _compiled(run: Callable[..., Any], *called: Callable[..., Any]) -> Any:
    """Compile a loop; only now numba is imported."""
    from ..compilation import compiled, source_version

    return compiled(run, source_version(_SOURCES), *called)


class Hindsight(NamedTuple):
    """Result of the backward sweep, by window; filled in place."""

    before: Array
    """Error of the attitude before the measurements [rad], (m, 3)."""
    after: Array
    """The same after them."""
    variance: Array
    """Of the tilt [rad^2], (m,)."""


@cache
def forward_kernel() -> Any:
    """Return the compiled forward pass over a block.

    It takes (columns, first sample, first window, coefficients, pass, tape, attitude, ends),
    fills the last three, and returns the next sample, the next window and the pass.
    """

    def run(
        columns: Any,
        i: int,
        begin: int,
        c: Any,
        state: Any,
        tape: Any,
        attitude: Any,
        ends: Any,
    ) -> Any:
        k = max(begin, 1)
        while i < columns.shape[1] and k < begin + tape.found.shape[0]:
            sample = sample_at(columns, i, 0.0)
            state, q = advance(state, sample, c, tape, k - begin)
            attitude[i, 0], attitude[i, 1], attitude[i, 2], attitude[i, 3] = q[0], q[1], q[2], q[3]
            if state.window.time == 0.0:
                ends[k] = i
                k += 1
            i += 1
        return i, k, state

    return _compiled(run, sample_at, advance)


@cache
def sweep_kernel() -> Any:
    """Return the compiled backward sweep over a block.

    It takes (tape, first window, window after the last, attitude, ends, later, hindsight),
    fills the last, and returns the smoothed state of the block's first window and the error after
    it.
    """

    def run(
        tape: Any, begin: int, end: int, attitude: Any, ends: Any, later: Any, hindsight: Any
    ) -> Any:
        error = np.zeros(STATES)
        for k in range(end - 1, begin - 1, -1):
            j = k - begin
            now, error = step_back(
                later, tape.prior[j], tape.posterior[j], tape.transition[j], tape.found[j]
            )
            later = BackwardState(
                now.prior.copy(), now.transition.copy(), now.found, now.covariance
            )
            hindsight.before[k] = now.found[:3]
            hindsight.after[k] = error[:3]
            q = attitude[ends[k]]
            heading = heading_of(matrix_of((q[0], q[1], q[2], q[3])))
            hindsight.variance[k] = tilt_variance(now.covariance, heading)
        return later, error

    called = (step_back, tilt_variance, heading_of, matrix_of)
    return _compiled(run, *called)


@cache
def spread_kernel() -> Any:
    """Return the compiled way from windows to samples.

    It takes (columns, attitude, ends, hindsight, tilt, variance) and fills the last two. Within
    a window the correction goes over from that after the window before to that before the
    measurements at its end.
    """

    def run(
        columns: Any, attitude: Any, ends: Any, hindsight: Any, tilt: Any, variance: Any
    ) -> None:
        for k in range(ends.size + 1):
            begin = ends[k - 1] + 1 if k > 0 else 0
            end = ends[k] + 1 if k < ends.size else attitude.shape[0]
            since, length = 0.0, 0.0
            for i in range(begin, end):
                length += columns[0, i]
            for i in range(begin, end):
                since += columns[0, i]
                share = since / length if length > 0.0 else 1.0
                if 0 < k < ends.size:
                    turn = (1.0 - share) * hindsight.after[k - 1] + share * hindsight.before[k]
                    spread = (1.0 - share) * hindsight.variance[k - 1]
                    spread += share * hindsight.variance[k]
                elif k == 0:
                    turn, spread = hindsight.before[0], hindsight.variance[0]
                else:
                    turn, spread = hindsight.after[k - 1], hindsight.variance[k - 1]
                q = (attitude[i, 0], attitude[i, 1], attitude[i, 2], attitude[i, 3])
                q = product(rotation_of((turn[0], turn[1], turn[2])), q)
                tilt[i], variance[i] = tilt_of(matrix_of(q)), spread

    return _compiled(run, product, rotation_of, matrix_of, tilt_of)
