"""Inertial navigation with the wheels as odometer: nothing is differentiated.

Gyro and accelerometer are integrated to attitude, velocity and position in three
dimensions. An error-state Kalman filter compares the distance moved with the wheel
encoder, and position and sideways motion with what a balancing robot can do; from the
differences it learns the errors of attitude, gyro (bias and gain) and accelerometer.
The gyro's own delay is compensated at the end: the estimate is where the last rate has led to.
Wheels are checked at every sample (`wheel_check`); while they contradict the accelerometer they
are ignored, and the navigation begins again without what they have repaired since they were last
right, or since the first reading (`beginning`); after a fall, from a vertical that has never seen
them (`vertical`); with what it had learnt before. They are ignored as well
where they led the navigation away from that vertical, made it learn errors of the sensors that no
calibration leaves (`learnt`), or push the gyro's bias to and fro, which drifts one way (`aiding`).
Until wheels have been right for the first time they are compared with the accelerometer by that
vertical, too (`first_wheel_check`). A body that lies still is
recognised by gyro and accelerometer (`stillness`), and the vertical is then where the
accelerometer points. Without wheels a mean force that slowly goes aside of the vertical and stays
there tells that the gyro's bias has changed; one that goes at once, that the robot accelerates.
Saturation of a sensor is missing information: a rate beyond the gyro's range is estimated
as a state of its own, a clipped acceleration leaves the velocity open.
A sensor that repeats its readings is slower than the samples: its rate is taken as linear between
two readings, and unless the robot falls the Kalman filter waits for the next one, for .1 s at most.

Names in brackets are files of `filters/inertial/`.

Groves, Principles of GNSS, Inertial and Multisensor Integrated Navigation Systems,
chapters 5, 14 and 16; the integration runs at every sample, the Kalman filter at most
every 5.5 ms.
"""

from typing import NamedTuple

import numpy as np

from ..samples import (
    LYING,
    QUIET_RATE,
    CorrectedSample,
    TiltEstimate,
    gravity_excess,
    is_saturated,
    shows_gravity,
    shows_rest,
)
from .base import Filter
from .inertial.adjusted import adjusted
from .inertial.aiding import (
    FIRST_DISTANCE,
    HOLD,
    Aiding,
    aid,
    begin_aiding,
    begin_distance,
    drift_noise,
    drifted_excess,
    estimate_excess,
    fading_time,
    is_pushed,
    observe_rest,
    reading_variance,
    rolled_distance,
    usable_wheels,
    watched,
    wheel_slopes,
    with_correction,
)
from .inertial.beginning import (
    DRIFT,
    KNOWN_DRIFT,
    RENEWED,
    Beginning,
    begin,
    carried,
    pulled_away,
    unrepaired,
    with_repair,
)
from .inertial.clipping import (
    GAP,
    Clipping,
    begin_clipping,
    clipped,
    rate_of_wheels,
    spun_variance,
    unseen_turn,
)
from .inertial.error_growth import propagated
from .inertial.error_state import ATTITUDE, DISTANCE, GYRO_BIAS, STATES, VELOCITY, Array
from .inertial.first_wheel_check import first_checked, passed_first
from .inertial.gravity import FeltGravity, begin_gravity, factor_of, scale_variance, weighed
from .inertial.learnt import LearntBefore, begin_memory, remembered, strangeness
from .inertial.navigation import (
    TILT_RATE,
    InertialReading,
    Navigation,
    Window,
    awaits_reading,
    empty_window,
    extend,
    faded,
    integrate,
    rate_beyond,
    read,
    repaired,
    share_kept,
)
from .inertial.parameters import Coefficients, Parameters, derive
from .inertial.restart import (
    FAST_VELOCITY,
    LOST,
    begin_navigation,
    contradicted,
    doubt_swing,
    first_covariance,
    restarted_at_beginning,
    restarted_at_vertical,
)
from .inertial.stillness import (
    ROLLED,
    SHAKING,
    Stillness,
    begin_stillness,
    is_still,
    noticed,
    rest_variance,
    shows_bias,
    unexplained_variance,
)
from .inertial.strapdown import (
    Vector,
    attitude_at,
    cross,
    heading_of,
    matrix_of,
    rotated,
    tilt_ahead,
)
from .inertial.vertical import (
    LEAST_FORCE,
    MEMORY,
    Vertical,
    agreed,
    apart_variance,
    at_rest,
    begin_vertical,
    bias_remarks,
    body_by,
    contradicts_rest,
    far_away_variance,
    followed,
    leaning_variance,
    off_level,
    swayed_variance,
    unknown_bias,
    unseen_variance,
    unsettled_variance,
    variance_of,
    with_axes_turned,
)
from .inertial.wheel_check import (
    PROVEN,
    WheelCheck,
    begin_check,
    believed,
    checked,
    clipped_of_late,
    condemned,
    misleading,
    proven,
    restarted,
    trustworthy,
    were_right,
    were_right_once,
)
from .inertial.wheel_remarks import wheel_remarks

PERIOD = 0.0055
"""Shortest time between two updates of the Kalman filter, which takes most of the time [s]: every
third sample at 500 Hz, every second at 200 Hz."""
FIRST_TILT = 0.3
"""Standard deviation of a first tilt that says nothing of its own [rad]."""
QUIET_TILT = 0.05
"""The same where the first reading is that of a body at rest [rad]."""
UNKNOWN_TILT = 2.0
"""The same where the first specific force is not gravity's [rad]."""
YAW_SHARE = 0.05
"""Relative standard deviation of a yaw rate that the wheels show."""
UNSEEN_ACCELERATION = 3.0
"""Standard deviation of the acceleration hidden in a gap [m/s^2]."""
LOST_TURN = 0.05
"""With a larger variance after a gap the attitude begins again from the vertical [rad^2]."""
UNSEEN_WITH_WHEELS = 0.3
"""Share of the variance of unseen turns that remains where wheels correct them that have never been
found wrong."""
UNSEEN_PROVEN = 0.1
"""The same where they have proven right."""
REST_DOUBT = 4.0
"""Variance at rest per square of the distance from the vertical."""
SOUND = 0.5
"""What was learnt is kept for later only while it is less strange than this."""
ROLL_SHARE = 0.5
"""What the corrections of the roll's bias say of a drift; less than those of the tilt's."""
RACING = 0.01
"""Growth of the variance of the distance where a robot falls faster than the gyro's range: its
wheels slip, and motors that stay on race [m^2/s]."""
FALLING = 6.0
"""A body that turns faster falls: its wheels slip, and teach no gain of the gyro [rad/s]."""
APART_TIME = 2.0
"""Time in which the doubt fades from force, vertical and navigation that pointed apart [s]: where a
robot accelerates to and fro they cross while the tilt is furthest off."""
ON_SIDE = 0.7
"""Upward share of the left axis beyond which the robot lies on its side, and no wheel rolls."""
JUMP = 0.05
"""After a larger repair of the attitude the velocities of the wheels' check begin afresh [rad]."""


class State(NamedTuple):
    """The estimate, the navigation behind it, and its covariance."""

    tilt: float
    rate: float
    gyro_bias: float
    tilt_variance: float
    navigation: Navigation
    last: InertialReading
    window: Window
    aiding: Aiding
    vertical: Vertical
    stillness: Stillness
    pending: float
    """That of the vertical when the present run of quiet readings began [rad^2]."""
    apart: float
    """Variance of the tilt of late, as force, vertical and navigation pointed apart [rad^2]."""
    check: WheelCheck
    first_check: WheelCheck
    memory: LearntBefore
    clipping: Clipping
    gravity: FeltGravity
    beginning: Beginning
    successor: Beginning
    """The beginning that follows while wheels are right."""
    covariance: Array
    """Of the error vector of `error_state`, (26, 26)."""


def reset(estimate: TiltEstimate, sample: CorrectedSample, c: Coefficients) -> State:
    """Continue from `estimate`, with the axle at rest; the accelerometer tells the roll."""
    return _begun(estimate, sample, 1.0, c)


def _begun(estimate: TiltEstimate, sample: CorrectedSample, felt: float, c: Coefficients) -> State:
    """Do that with an accelerometer that reads gravity `felt` times."""
    accel = (sample.accel_x, sample.accel_y, sample.accel_z)
    bias = (0.0, estimate.gyro_bias, 0.0)
    rate = (sample.gyro_x, sample.gyro_y - estimate.gyro_bias, sample.gyro_z)
    attitude = attitude_at(estimate.tilt - c.gyro_delay * rate[1], accel)
    swing = rotated(matrix_of(attitude), cross(rate, c.geometry.lever))  # while the axle is slow
    nav = begin_navigation(attitude, bias, swing)
    variance = unsure = FIRST_TILT * FIRST_TILT
    if estimate.tilt_variance > 0.0:
        variance, unsure = estimate.tilt_variance, 0.0
    elif shows_rest(sample, estimate.tilt, estimate.gyro_bias):
        variance = QUIET_TILT * QUIET_TILT
    elif not shows_gravity(sample):
        variance = UNKNOWN_TILT * UNKNOWN_TILT
    p = first_covariance(variance, c)
    doubt_swing(p, swing)
    now = read(nav, rate, sample, (0.0, 0.0))
    return State(
        tilt=estimate.tilt,
        rate=estimate.rate,
        gyro_bias=estimate.gyro_bias,
        tilt_variance=variance,
        navigation=nav,
        last=now,
        window=empty_window(),
        aiding=begin_aiding(sample),
        vertical=begin_vertical(now.force, bias, max(variance, unsure)),
        stillness=begin_stillness(sample),
        pending=0.0,
        apart=0.0,
        check=begin_check(unsure),
        first_check=begin_check(),
        memory=begin_memory(nav),
        clipping=begin_clipping(sample),
        gravity=begin_gravity(felt),
        beginning=begin(variance, DRIFT),
        successor=begin(variance, DRIFT),
        covariance=p,
    )


def step(state: State, sample: CorrectedSample, c: Coefficients) -> State:
    """Integrate one sample; at the end of a window compare and repair."""
    if state.tilt_variance == UNKNOWN_TILT * UNKNOWN_TILT:
        return _woken(state, sample, c)
    gravity = weighed(state.gravity, sample, state.last.body)
    sample = _adjusted(state, gravity, sample, c)
    geometry, last = c.geometry, state.last
    nav, now = integrate(state.navigation, last, sample, geometry.lever, c.room_time)
    stillness = noticed(state.stillness, sample, now.held)
    clipping = clipped(state.clipping, last.gyro[1], sample)
    unseen = unseen_turn(clipping, sample, now.body)
    vertical = followed(state.vertical, now.body, now.rate, sample, unseen, c.gyro_gain)
    fallen = state.check.waiting > 0.0 and abs(state.tilt) > LYING  # the wheels may race
    aside = _on_side(now)
    wheels = not (_without_wheels(sample, state.check) or fallen or aside)
    hidden = unseen_variance(vertical) if clipped_of_late(state.check) else 0.0
    still = is_still(stillness, vertical.bias, wheels, hidden)
    off = rest_variance(stillness)
    lasted = stillness.time
    pending = state.pending if lasted > 0.0 else vertical.pending
    if still:
        unsure = off + unexplained_variance(stillness, vertical.bias)
        still = not contradicts_rest(vertical, now.body, stillness.accel, unsure, lasted, pending)
    if still:
        vertical = at_rest(vertical, now.body, stillness.accel, stillness.gyro, off, sample.dt)
    elif proven(state.check):
        vertical = agreed(vertical, nav.gyro_bias, sample.dt)
    blinded = unseen > 0.0 or is_saturated(sample) or aside
    variance, left = _navigation_variance(state), nav.lever_left
    check = checked(state.check, sample, now, variance, left, geometry, still, blinded)
    first = state.first_check
    if not passed_first(first):
        body = body_by(vertical, now.body)
        first = first_checked(first, sample, now, body, left, geometry, still, blinded)
        if first.trust.ignored > 0.0:
            check = condemned(check)
    moved = State(
        tilt=tilt_ahead(now.tilt, now.body, now.rate, c.gyro_delay),
        rate=now.rate[1],
        gyro_bias=nav.gyro_bias[1],
        tilt_variance=state.tilt_variance,
        navigation=nav,
        last=now,
        window=extend(state.window, last, now, sample),
        aiding=watched(state.aiding, sample),
        vertical=vertical,
        stillness=stillness,
        pending=pending,
        apart=state.apart,
        check=check,
        first_check=first,
        memory=state.memory,
        clipping=clipping,
        gravity=gravity,
        beginning=carried(state.beginning, unseen, sample.dt),
        successor=carried(state.successor, unseen, sample.dt),
        covariance=state.covariance,
    )
    waits = awaits_reading(last, now, moved.window) and not _falls(moved.tilt, now)
    steady = sample.dt <= GAP and nav.exceeded == rate_beyond(sample)
    if steady and (waits or moved.window.time < PERIOD):
        return moved
    return _compared(moved, unseen, still, sample, c)


def _woken(state: State, sample: CorrectedSample, c: Coefficients) -> State:
    """Begin at the first sample that shows gravity: before, a chip wakes up, or a robot falls."""
    rate, variance, felt = sample.gyro_y - state.gyro_bias, 0.0, 1.0
    tilt = state.tilt + rate * sample.dt
    if shows_gravity(sample):
        tilt = sample.angle
    elif _stays(state.last.accel, sample):
        tilt, variance, felt = sample.angle, FIRST_TILT * FIRST_TILT, 1.0 + gravity_excess(sample)
    return _begun(TiltEstimate(tilt, rate, state.gyro_bias, variance), sample, felt, c)


def _stays(felt: Vector, sample: CorrectedSample) -> bool:
    """Whether a quiet body feels another force than gravity: an accelerometer of another scale."""
    x, y, z = sample.accel_x - felt[0], sample.accel_y - felt[1], sample.accel_z - felt[2]
    p, q, r = sample.gyro_x, sample.gyro_y, sample.gyro_z
    alike = x * x + y * y + z * z < SHAKING * SHAKING
    feels = felt[0] * felt[0] + felt[1] * felt[1] + felt[2] * felt[2] > LEAST_FORCE * LEAST_FORCE
    quiet = p * p + q * q + r * r < QUIET_RATE * QUIET_RATE
    return alike and feels and quiet and not is_saturated(sample)


def _navigation_variance(state: State) -> float:
    """Return the variance of the tilt that the wheels are checked with [rad^2]."""
    own = tilt_variance(state.covariance, heading_of(state.last.body))
    unseen = UNSEEN_WITH_WHEELS * unseen_variance(state.vertical)
    return max(state.aiding.surprise, 1.0) * own + unseen


def _adjusted(
    state: State, gravity: FeltGravity, sample: CorrectedSample, c: Coefficients
) -> CorrectedSample:
    """Return the sample with the wheels' yaw rate for a clipped one, and without wheels scaled."""
    rate, variance, clip = sample.gyro_z, sample.gyro_variance_z, sample.gyro_saturated_z
    per_difference, factor = c.geometry.yaw_per_difference, 1.0
    if clip > 0.0 and per_difference > 0.0 and believed(state.check):
        rate = rate_of_wheels(state.clipping, sample, state.last.body, per_difference)
        if rate != sample.gyro_z:
            deviation = YAW_SHARE * rate
            variance, clip = deviation * deviation, 0.0
    if _without_wheels(sample, state.check):
        factor = factor_of(gravity)
    if factor == 1.0 and clip == sample.gyro_saturated_z:
        return sample
    return adjusted(sample, rate, variance, clip, factor)


def _compared(
    moved: State, unseen: float, still: bool, sample: CorrectedSample, c: Coefficients
) -> State:
    """Bring the covariance up to date, compare with all that is known, repair the navigation.

    Args:
        moved: the state whose window ends.
        unseen: variance of what the gyro did not see of the last turn [rad^2].
        still: whether the body lies still.
        sample: the last one.
        c: coefficients.
    """
    nav, now, time, check = moved.navigation, moved.last, moved.window.time, moved.check
    keep = share_kept(fading_time(moved.aiding, c.accel_bias_time, time), c.accel_bias_time)
    p = _propagated(moved, unseen, keep, sample, c)
    error = np.zeros(STATES)
    racing = still and moved.stillness.rolled > ROLLED
    roll = believed(check) and not (racing or _on_side(now))
    wheels = usable_wheels(moved.aiding, sample) if roll else 0.0
    aiding = _aided(p, error, moved, wheels, still, sample, c)
    fixed = repaired(nav, error)
    excess = drifted_excess(p, fixed, time, sample)
    fixed = faded(fixed, keep, excess, rate_beyond(sample))
    vertical = with_axes_turned(moved.vertical, (error[0], error[1], error[2]))
    if error[0] * error[0] + error[1] * error[1] > JUMP * JUMP:
        check = restarted(check)
    strange, off = strangeness(fixed, c), contradicted(vertical, p, still)
    beginning = with_repair(moved.beginning, error, time)
    successor = with_repair(moved.successor, error, time)
    falling, known = _falls(moved.tilt, now), were_right(check)
    if known and (falling or moved.aiding.calm < time):  # too much for the gyro alone
        beginning = successor = begin(LOST, DRIFT)
    early = not (known or passed_first(moved.first_check))
    pulled = is_pushed(aiding) or (early and pulled_away(beginning))
    off_course = pulled or (off and vertical.age >= MEMORY)
    if wheels > 0.0 and (strange > 1.0 or (off_course and not still)):
        check = condemned(check)
    astray = check.trust.ignored > 0.0 and check.trust.since < time
    lost = sample.dt > GAP and unseen > LOST_TURN
    memory = moved.memory
    biased = still and shows_bias(moved.stillness, fixed.gyro_bias)
    if biased:
        memory = begin_memory(begin_navigation(fixed.attitude, vertical.bias))
    begins = astray or lost or off or biased
    if begins:
        learnt = astray and were_right_once(check) and not falling
        if astray and not (lost or biased) and beginning.variance < variance_of(vertical):
            afresh = restarted_at_beginning(fixed, vertical, beginning, p, memory, learnt, c)
            beginning = unrepaired(beginning)
        else:
            lost = lost and not biased
            afresh = restarted_at_vertical(fixed, vertical, p, memory, lost, off, learnt, c)
            beginning = begin(LOST, DRIFT)
        successor = begin(LOST, DRIFT)
        fixed, vertical, p = afresh.navigation, afresh.vertical, afresh.covariance
        aiding, check = begin_aiding(sample), restarted(check)
    sound = (wheels == 0.0 or trustworthy(check)) and check.trust.doubted == 0.0 and strange < SOUND
    now = read(fixed, now.rate, sample, now.held)
    right = check.trust.proven > PROVEN
    sure = check.trust.total == 0.0 and (aiding.calm >= HOLD or right)
    share = 1.0
    if wheels > 0.0 and sure:
        share = UNSEEN_PROVEN if right else UNSEEN_WITH_WHEELS
    first = LOST if known else beginning.variance
    doubt = share * min(unseen_variance(vertical), first)
    doubt += far_away_variance(vertical) + scale_variance(moved.gravity)
    doubt += spun_variance(moved.clipping, now.body, wheels)
    apart = leaning_variance(vertical) + apart_variance(vertical)
    if not (still or begins):
        apart = max(apart, moved.apart * max(1.0 - time / APART_TIME, 0.0))
    if wheels == 0.0:
        doubt += swayed_variance(vertical) + apart
    elif not sure:
        doubt += off_level(vertical)
    if still:
        doubt += REST_DOUBT * off_level(vertical)
    else:
        doubt += unexplained_variance(moved.stillness, fixed.gyro_bias)
    own = max(aiding.surprise, 1.0) * tilt_variance(p, heading_of(now.body))
    if known and sound and wheels > 0.0 and successor.lasted > RENEWED:
        beginning, successor = successor, begin(own, KNOWN_DRIFT)
    return State(
        tilt=tilt_ahead(now.tilt, now.body, now.rate, c.gyro_delay),
        rate=now.rate[1],
        gyro_bias=fixed.gyro_bias[1],
        tilt_variance=own + doubt + c.mounting_variance,
        navigation=fixed,
        last=now,
        window=empty_window(),
        aiding=aiding,
        vertical=vertical,
        stillness=moved.stillness,
        pending=moved.pending,
        apart=apart,
        check=check,
        first_check=moved.first_check,
        memory=remembered(memory, fixed, sound, time),
        clipping=moved.clipping,
        gravity=moved.gravity,
        beginning=beginning,
        successor=successor,
        covariance=p,
    )


def _without_wheels(sample: CorrectedSample, check: WheelCheck) -> bool:
    """Whether there are no wheels, or none but wrong ones."""
    return sample.wheel_count == 0.0 or check.trust.ignored > 0.0


def _on_side(now: InertialReading) -> bool:
    """Whether the robot lies on its side, where its tilt says little and its wheels nothing."""
    return abs(now.body[7]) > ON_SIDE


def _falls(tilt: float, now: InertialReading) -> bool:
    """Whether the robot falls or lies, so that its wheels slip and tell nothing of its sensors."""
    return abs(tilt) > LYING or abs(now.rate[1]) > FALLING


def _propagated(
    moved: State, unseen: float, keep: float, sample: CorrectedSample, c: Coefficients
) -> Array:
    """Return the covariance at the end of the window; see `propagated` and `_compared`."""
    nav, count = moved.navigation, sample.wheel_count
    p = propagated(moved.covariance, nav, moved.last, moved.window, keep, count, c)
    if _without_wheels(sample, moved.check):
        for axis, off in enumerate(unknown_bias(moved.vertical, moved.last.body)):
            i = GYRO_BIAS + axis
            p[i, i] = max(p[i, i], off * off)
    else:
        roll, tilt = moved.aiding.drifting
        p[GYRO_BIAS, GYRO_BIAS] += drift_noise(ROLL_SHARE * roll, moved.window.time)
        p[GYRO_BIAS + 1, GYRO_BIAS + 1] += drift_noise(tilt, moved.window.time)
    if nav.exceeded == TILT_RATE and abs(moved.tilt) > LYING:
        p[DISTANCE, DISTANCE] += RACING * moved.window.time
    if sample.dt > GAP:
        silent = sample.dt - GAP
        for i in range(2):
            p[ATTITUDE + i, ATTITUDE + i] += unseen
        for i in range(3):
            p[VELOCITY + i, VELOCITY + i] += (UNSEEN_ACCELERATION * silent) ** 2
        p[DISTANCE, DISTANCE] += (UNSEEN_ACCELERATION * silent * silent) ** 2
    return p


def _aided(
    p: Array,
    error: Array,
    moved: State,
    wheels: float,
    still: bool,
    sample: CorrectedSample,
    c: Coefficients,
) -> Aiding:
    """Compare with wheels, room and rest; `p` and `error` are changed in place."""
    nav, now, time, geometry = moved.navigation, moved.last, moved.window.time, c.geometry
    aiding, step_size = moved.aiding, moved.check.steps.size
    if wheels > 0.0 and wheels != aiding.wheels:
        error[DISTANCE] = rolled_distance(nav, now, sample, geometry) - nav.distance
        first = max(reading_variance(geometry, step_size, time), FIRST_DISTANCE * FIRST_DISTANCE)
        begin_distance(p, wheel_slopes(nav, now, geometry), first)
        if moved.check.trust.total > 0.0:
            for i in range(2):
                p[VELOCITY + i, VELOCITY + i] += FAST_VELOCITY * FAST_VELOCITY
    if nav.exceeded > 0.0:
        estimate_excess(p, error, nav, sample)
    keep_gains = still or _falls(moved.tilt, now) or misleading(moved.check)
    compared = aid(
        p, error, nav, now, sample, wheels, aiding, geometry, time, step_size, keep_gains
    )
    if still:
        lasted = moved.stillness.time
        off = max(rest_variance(moved.stillness), unsettled_variance(moved.vertical))
        observe_rest(p, error, moved.vertical.up, off, lasted, time)
    return with_correction(compared, (error[GYRO_BIAS], error[GYRO_BIAS + 1]), time)


def tilt_variance(p: Array, heading: tuple[float, float]) -> float:
    """Return the variance of a turn about the robot's left axis [rad^2]."""
    forward, left = heading
    across = left * left * p[0, 0] + forward * forward * p[1, 1]
    return float(across - 2.0 * left * forward * p[0, 1])


FILTER = Filter(
    name="ins_odometer",
    title="Inertial navigation aided by the wheels as odometer.",
    source="Groves 2013, chapters 5, 14, 16",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    derive=derive,
    uses_wheels=True,
    remarks=lambda state: wheel_remarks(state.check) + bias_remarks(state.vertical),
    wheels_ignored=lambda state: state.check.trust.total,
)
