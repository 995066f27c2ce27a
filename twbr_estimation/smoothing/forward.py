"""The forward pass of the smoother: the error-state filter of `ins_odometer`, written down.

Navigation, covariance and measurements are the functions of the filter. Their order is another,
so that the two steps share parts and not a whole: a slip increases the covariance before the
measurement, as noise of the step; biases are estimated at all times, because the backward sweep
corrects wrong ones; nothing is replaced by the vertical, and neither wheels nor rest are judged,
as a state that begins afresh has no way back; and everything that the backward sweep needs is kept.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..filters.inertial.aiding import (
    FIRST_DISTANCE,
    ROOM_PERIOD,
    Aiding,
    begin_distance,
    beyond_gate,
    drifted_excess,
    estimate_excess,
    excess_kept,
    observe_level,
    observe_room,
    observe_side,
    rolled_distance,
    watched,
    wheel_slopes,
)
from ..filters.inertial.error_growth import propagated, transition
from ..filters.inertial.error_state import (
    ACCEL_BIAS,
    DISTANCE,
    EXCESS,
    MOVING,
    SOURCES,
    STATES,
    Array,
    observe,
)
from ..filters.inertial.navigation import (
    YAW_RATE,
    InertialReading,
    Navigation,
    Window,
    empty_window,
    extend,
    faded,
    integrate,
    rate_beyond,
    read,
    repaired,
    share_kept,
)
from ..filters.inertial.parameters import Coefficients
from ..filters.inertial.restart import LOST
from ..filters.inertial.strapdown import Quaternion
from ..filters.ins_odometer import PERIOD, State, reset
from ..samples import CorrectedSample, TiltEstimate


class Pass(NamedTuple):
    """State of the forward pass between two samples."""

    navigation: Navigation
    last: InertialReading
    window: Window
    aiding: Aiding
    covariance: Array
    excess_kept: float
    """Share of the excess rate's error that outlives the last update."""


class Tape(NamedTuple):
    """Input of the backward sweep: a block of m windows, s error states; filled in place."""

    prior: Array
    """Covariance before the measurements, (m, s, s)."""
    posterior: Array
    """Covariance after them, (m, s, s)."""
    transition: Array
    """From the error after the last window to this one's, (m, s, s); zero for a new start."""
    found: Array
    """Error that the measurements found, (m, s)."""


def empty_tape(windows: int) -> Tape:
    """Return a tape for so many windows."""
    square = (windows, STATES, STATES)
    return Tape(
        np.empty(square),
        np.empty(square),
        np.empty(square),
        np.empty((windows, STATES)),
    )


def started(state: State, tape: Tape, k: int) -> Pass:
    """Begin with window `k` where a fresh filter begins."""
    tape.prior[k] = tape.posterior[k] = state.covariance
    tape.transition[k] = 0.0
    tape.found[k] = 0.0
    return Pass(
        state.navigation, state.last, state.window, state.aiding, state.covariance.copy(), 0.0
    )


def advance(
    state: Pass, sample: CorrectedSample, c: Coefficients, tape: Tape, k: int
) -> tuple[Pass, Quaternion]:
    """Integrate one sample; at the end of its window `k` compare and write down.

    Args:
        state: after the last sample.
        sample: the new one.
        c: the filter's coefficients.
        tape: what is written.
        k: window within the block.

    Returns:
        The state, whose window is empty where one ended, and the attitude before measurements.
    """
    last = state.last
    nav, now = integrate(state.navigation, last, sample, c.geometry.lever, c.room_time)
    window = extend(state.window, last, now, sample)
    aiding = watched(state.aiding, sample)
    if window.time < PERIOD and nav.exceeded == rate_beyond(sample):
        waiting = Pass(nav, now, window, aiding, state.covariance, state.excess_kept)
        return waiting, nav.attitude
    compared = _compared(state, nav, now, window, aiding, sample, c, tape, k)
    return compared, nav.attitude


def _compared(
    state: Pass,
    nav: Navigation,
    now: InertialReading,
    window: Window,
    aiding: Aiding,
    sample: CorrectedSample,
    c: Coefficients,
    tape: Tape,
    k: int,
) -> Pass:
    keep = share_kept(window.time, c.accel_bias_time)
    p = propagated(state.covariance, nav, now, window, keep, sample.wheel_count, c)
    f = transition_of(nav, now, window, c, state.excess_kept)
    if not p[0, 0] + p[1, 1] < LOST:
        bias = nav.gyro_bias[1]
        afresh = TiltEstimate(sample.angle, sample.gyro_y - bias, bias, 0.0)
        return started(reset(afresh, sample, c), tape, k)
    nav = _opened(nav, now, p, f, sample, aiding, c)
    tape.prior[k], tape.transition[k] = p, f
    error = np.zeros(STATES)
    _observed(p, error, nav, now, sample, aiding, c)
    tape.posterior[k], tape.found[k] = p, error
    fixed = _carried(p, repaired(nav, error), window.time, sample, c)
    return Pass(
        fixed,
        read(fixed, now.rate, sample, now.held),
        empty_window(),
        Aiding(
            aiding.calm,
            0.0 if aiding.unchecked >= ROOM_PERIOD else aiding.unchecked,
            sample.wheel_count,
            0.0,
            1.0,
            aiding.angle,
            aiding.turned,
            aiding.drifting,
            aiding.to_and_fro,
        ),
        p,
        excess_kept(window.time, nav.exceeded) if fixed.exceeded == nav.exceeded > 0.0 else 0.0,
    )


def _carried(
    p: Array, nav: Navigation, time: float, sample: CorrectedSample, c: Coefficients
) -> Navigation:
    """Let the accelerometer's bias fade and the rate beyond the range change over a window."""
    excess, keep = drifted_excess(p, nav, time, sample), share_kept(time, c.accel_bias_time)
    return faded(nav, keep, excess, rate_beyond(sample))


def _opened(
    nav: Navigation,
    now: InertialReading,
    p: Array,
    f: Array,
    sample: CorrectedSample,
    aiding: Aiding,
    c: Coefficients,
) -> Navigation:
    """Let the distance slip where the wheel disagrees, and begin it where wheels appear.

    In the causal filter this is part of the measurement; here it must come before it.
    """
    geometry = c.geometry
    if sample.wheel_count == 0.0:
        return nav
    residual = rolled_distance(nav, now, sample, geometry) - nav.distance
    if sample.wheel_count != aiding.wheels:
        h = wheel_slopes(nav, now, geometry)
        begin_distance(p, h, FIRST_DISTANCE * FIRST_DISTANCE)
        f[DISTANCE, :] = 0.0
        for i, slope in zip(h.at, h.by):  # noqa: B905 (numba does not support strict)
            if i != DISTANCE:
                f[DISTANCE, :] -= slope * f[i, :]
        change = np.zeros(STATES)
        change[DISTANCE] = residual
        return repaired(nav, change)
    noise = geometry.wheel_noise * geometry.wheel_noise
    p[DISTANCE, DISTANCE] += beyond_gate(p, wheel_slopes(nav, now, geometry), residual, noise)
    return nav


def _observed(
    p: Array,
    error: Array,
    nav: Navigation,
    now: InertialReading,
    sample: CorrectedSample,
    aiding: Aiding,
    c: Coefficients,
) -> None:
    """Compare with everything that is known at this sample."""
    if nav.exceeded > 0.0:
        estimate_excess(p, error, nav, sample)
    if sample.wheel_count > 0.0:
        geometry = c.geometry
        residual = rolled_distance(nav, now, sample, geometry) - nav.distance
        noise = geometry.wheel_noise * geometry.wheel_noise
        observe(p, error, wheel_slopes(nav, now, geometry), residual, noise, 1.0, 1.0)
    spins = nav.exceeded == YAW_RATE and sample.wheel_count > 0.0
    if sample.wheel_count > 1.5 or spins:
        observe_side(p, error, nav, now, 1.0, 1.0, c.geometry)
    if spins:
        observe_level(p, error, now, 1.0, 1.0)
    if aiding.unchecked >= ROOM_PERIOD:
        observe_room(p, error, nav, now, sample.wheel_count, 1.0, 1.0, c.geometry)


def transition_of(
    nav: Navigation, now: InertialReading, window: Window, c: Coefficients, excess_kept: float
) -> Array:
    """Return how the error vector moves over a window: the F of `propagated`.

    Args:
        nav: at the end of the window.
        now: its last reading.
        window: its integrals.
        c: the filter's coefficients.
        excess_kept: share of the excess rate's error that outlived the update before.
    """
    f = np.eye(STATES)
    weights = transition(nav, now, window, c)
    for i in range(MOVING):
        for k in range(SOURCES.shape[0]):
            f[i, SOURCES[k, i]] += weights[k, i]
    keep = share_kept(window.time, c.accel_bias_time)
    for i in range(3):
        f[ACCEL_BIAS + i, ACCEL_BIAS + i] = keep
    f[:, EXCESS] *= excess_kept
    return f
