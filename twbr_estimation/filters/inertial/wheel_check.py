"""Whether the wheels move as the accelerometer feels: checked at every sample, not believed.

Two velocities of the sensor along the robot's heading are compared, one from the encoders and
one from the accelerometer, the latter free of gravity as `vertical` has it. Both pass the same
filters, which leave the band in which neither a tilt that is a little wrong nor the steps of an
encoder count. The mean square of their difference, over that of the larger one, is 1 where the
wheels stand while the body is carried, or run while it is held, 4 where a sign is wrong, a
quarter where one of two is frozen, and a few hundredths where they roll. No covariance of the
navigation has a part in it: a lie that the navigation has learnt would vouch for itself.
"""

from __future__ import annotations

from typing import NamedTuple

from ...samples import STANDARD_GRAVITY, CorrectedSample
from .strapdown import Matrix, Vector, heading_of, rotated, tilt_of

SMOOTHED = 0.03
"""Time over which both velocities are averaged [s]."""
BAND = 0.3
"""Slower changes than this are left out, twice [s]."""
SLOW, FAST = 2.0, 0.3
"""Times over which squares are averaged [s]."""
SMALLEST = 0.03
"""A velocity that counts for nothing [m/s]."""
PER_TILT = 3.0
"""What an uncertain vertical adds to that [m/s per rad]."""
DOUBTED, CLEARED = 0.6, 0.3
"""Share of the fast squares above which wheels are left out, and below which they return."""
CONDEMNED, ACQUITTED = 0.18, 0.08
"""Share of the slow squares above which wheels are ignored; below the second one nothing speaks
against them, and of the fast squares it is proof."""
PROVEN = 1.0
"""So long must the wheels be right before they are believed again [s]."""
RELAPSE, RELAPSE_FACTOR, LONGEST_PROOF = 20.0, 4.0, 60.0
"""Wheels that are wrong again within the first [s] must be right so many times longer, at most
the last [s]."""
PROOF = 2.0
"""A motion must exceed what counts for nothing so many times to prove anything."""
EQUAL = 0.02
"""Share of the fast squares below which the velocities are the same: an unsure vertical excuses a
difference, but where there is none it is right as well."""
FORGIVEN = 1.0
"""After a clipped sensor nothing is compared for so long [s]."""
FIRST_STEP = 0.15
"""An encoder counts in smaller steps than this [rad], as long as nothing else is known."""
STEP_SHARE = 0.2
"""Share of a new step in their mean."""
STEP_TIME = 0.08
"""Steps of an encoder over this time are a velocity that counts for nothing [s]."""
PROBATION = 0.3
"""The velocities need so long to begin [s]."""


class Steps(NamedTuple):
    """The steps in which an encoder counts, as they are seen."""

    angle: float
    """Wheel angle one sample ago [rad]."""
    held: float
    """1 where it was the same one sample before that."""
    size: float
    """Mean step after a pause [rad]."""


def stepped(steps: Steps, angle: float) -> Steps:
    """Return what is known of the steps one sample later.

    None is larger than the smallest change of the angle; after a pause the change is one.
    """
    change = abs(angle - steps.angle)
    if change == 0.0:
        return Steps(angle, 1.0, steps.size)
    size = min(steps.size, change)
    if steps.held > 0.0 and change < FIRST_STEP:
        size = steps.size + STEP_SHARE * (change - steps.size)
    return Steps(angle, 0.0, size)


class WheelCheck(NamedTuple):
    """What the comparison remembers."""

    known: float
    """1 where the distance is known, else 0."""
    travelled: float
    """Distance by the encoders, averaged [m]."""
    swing: float
    """Sideways place of the sensor one sample ago [m]."""
    turning: float
    """What turning adds to the velocity at the sensor, averaged [m/s]."""
    acceleration: float
    """Forward acceleration one sample ago [m/s^2]."""
    rolled_slow: float
    """Slow part of the wheels' velocity [m/s]."""
    rolled_mean: float
    """Slow part of the rest of it [m/s]."""
    felt_mean: float
    """Slow part of the acceleration [m/s^2]."""
    felt: float
    """Velocity by the accelerometer [m/s]."""
    felt_smooth: float
    """The same, averaged as the encoders' [m/s]."""
    slow: tuple[float, float, float]
    """Mean squares of difference, wheels' and accelerometer's velocity [(m/s)^2]."""
    fast: tuple[float, float, float]
    """The same over a shorter time."""
    waiting: float
    """Time left in which nothing is compared [s]."""
    proven: float
    """For how long the wheels have been right [s]."""
    doubted: float
    """1 while wheels are left out for the moment, else 0."""
    ignored: float
    """1 while wheels are ignored, else 0."""
    since: float
    """How long ago that began [s]."""
    total: float
    """How long wheels were ignored in all [s]."""
    steps: Steps
    """Of the encoder."""
    unsure: float
    """Largest variance of the tilt of late [rad^2]."""
    needed: float
    """How long wheels must be right before they are believed again [s]."""


def begin_check() -> WheelCheck:
    """Begin with wheels that have proven nothing."""
    zeros = (0.0, 0.0, 0.0)
    return WheelCheck(
        known=0.0,
        travelled=0.0,
        swing=0.0,
        turning=0.0,
        acceleration=0.0,
        rolled_slow=0.0,
        rolled_mean=0.0,
        felt_mean=0.0,
        felt=0.0,
        felt_smooth=0.0,
        slow=zeros,
        fast=zeros,
        waiting=PROBATION,
        proven=0.0,
        doubted=0.0,
        ignored=0.0,
        since=0.0,
        total=0.0,
        steps=Steps(0.0, 0.0, FIRST_STEP),
        unsure=0.0,
        needed=PROVEN,
    )


def believed(check: WheelCheck) -> bool:
    """Whether the wheels are used."""
    return check.doubted == 0.0 and check.ignored == 0.0


def proven(check: WheelCheck) -> bool:
    """Whether the wheels have proven right by moving as the accelerometer felt."""
    return check.proven > PROVEN and check.waiting <= 0.0 and believed(check)


def trustworthy(check: WheelCheck) -> bool:
    """Whether nothing speaks against the wheels of late."""
    largest = max(check.slow[1], check.slow[2]) + SMALLEST * SMALLEST
    return check.slow[0] < ACQUITTED * largest


def restarted(check: WheelCheck) -> WheelCheck:
    """Return the check with velocities that begin afresh, as the attitude was replaced."""
    return WheelCheck(
        0.0,
        check.travelled,
        check.swing,
        check.turning,
        check.acceleration,
        check.rolled_slow,
        check.rolled_mean,
        check.felt_mean,
        check.felt,
        check.felt_smooth,
        check.slow,
        check.fast,
        check.waiting,
        check.proven,
        check.doubted,
        check.ignored,
        check.since,
        check.total,
        check.steps,
        check.unsure,
        check.needed,
    )


def checked(
    check: WheelCheck,
    sample: CorrectedSample,
    body: Matrix,
    rate: Vector,
    up: Vector,
    variance: float,
    lever: Vector,
    wheel_radius: float,
    on_body: float,
    still: bool,
    blinded: bool,
) -> WheelCheck:
    """Return the check one sample later.

    Args:
        check: one sample ago.
        sample: the new one.
        body: attitude.
        rate: body rate [rad/s].
        up: the vertical in level axes.
        variance: its variance [rad^2].
        lever: position of the sensor relative to the axle's middle, body axes [m].
        wheel_radius: [m].
        on_body: 1 where the encoder counts against the body, else 0.
        still: whether the body lies still.
        blinded: whether a sensor was clipped, or silent, at this sample.
    """
    dt = sample.dt
    forward, left = heading_of(body)
    arm = rotated(body, lever)
    ahead, aside = arm[0] * forward + arm[1] * left, arm[1] * forward - arm[0] * left
    yaw = body[6] * rate[0] + body[7] * rate[1] + body[8] * rate[2]
    force = rotated(body, (sample.accel_x, sample.accel_y, sample.accel_z))
    distance = wheel_radius * (sample.wheel_angle + on_body * tilt_of(body)) + ahead
    gravity = STANDARD_GRAVITY * (up[0] * forward + up[1] * left)
    acceleration = force[0] * forward + force[1] * left - gravity
    acceleration += yaw * (yaw * ahead + (aside - check.swing) / dt)
    if still:
        acceleration = 0.0
    if sample.wheel_count == 0.0 or check.known == 0.0 or blinded:
        return _paused(check, dt, distance, aside, yaw * aside, acceleration, blinded, sample)
    unsure = max(variance, check.unsure * max(1.0 - dt / SLOW, 0.0))
    smooth, band = dt / (SMOOTHED + dt), dt / (BAND + dt)
    moved = smooth * (distance - check.travelled)
    turning = check.turning + smooth * (yaw * aside - check.turning)
    velocity = moved / dt - check.turning
    rolled_slow = check.rolled_slow + band * (velocity - check.rolled_slow)
    rolled = velocity - rolled_slow
    rolled_mean = check.rolled_mean + band * (rolled - check.rolled_mean)
    rolled -= rolled_mean
    mean = 0.5 * (acceleration + check.acceleration)
    felt_mean = check.felt_mean + band * (mean - check.felt_mean)
    felt = (check.felt + dt * (mean - felt_mean)) * (1.0 - band)
    felt_smooth = check.felt_smooth + smooth * (felt - check.felt_smooth)
    moved_on = WheelCheck(
        1.0,
        check.travelled + moved,
        aside,
        turning,
        acceleration,
        rolled_slow,
        rolled_mean,
        felt_mean,
        felt,
        felt_smooth,
        check.slow,
        check.fast,
        check.waiting - dt,
        check.proven,
        check.doubted,
        check.ignored,
        check.since + dt,
        check.total + check.ignored * dt,
        stepped(check.steps, sample.wheel_angle),
        unsure,
        check.needed,
    )
    if moved_on.waiting > 0.0:
        return moved_on
    step = wheel_radius * moved_on.steps.size / STEP_TIME
    least = SMALLEST * SMALLEST + step * step
    return _judged(moved_on, rolled, least, least + PER_TILT * PER_TILT * unsure, dt)


def _paused(
    check: WheelCheck,
    dt: float,
    distance: float,
    aside: float,
    turning: float,
    acceleration: float,
    blinded: bool,
    sample: CorrectedSample,
) -> WheelCheck:
    """Begin the velocities afresh: there is nothing to compare."""
    waiting = max(check.waiting - dt, FORGIVEN if blinded else PROBATION)
    known = sample.wheel_count > 0.0
    return WheelCheck(
        1.0 if known else 0.0,
        distance,
        aside,
        turning,
        acceleration,
        check.rolled_slow,
        check.rolled_mean,
        check.felt_mean,
        check.felt,
        check.felt_smooth,
        check.slow,
        check.fast,
        waiting,
        check.proven,
        check.doubted,
        check.ignored,
        check.since + dt,
        check.total + check.ignored * dt,
        Steps(sample.wheel_angle, 0.0, check.steps.size),
        check.unsure,
        check.needed,
    )


def _judged(
    check: WheelCheck, rolled: float, least: float, nothing: float, dt: float
) -> WheelCheck:
    """Average the squares and judge.

    Args:
        check: averages up to the sample before.
        rolled: velocity by the wheels [m/s].
        least: square of a velocity that counts for nothing, where the vertical is known.
        nothing: the same with what the vertical is unsure by.
        dt: [s].
    """
    difference = rolled - check.felt_smooth
    squares = (difference * difference, rolled * rolled, check.felt_smooth * check.felt_smooth)
    slow, fast = (
        _averaged(check.slow, squares, dt / SLOW),
        _averaged(check.fast, squares, dt / FAST),
    )
    largest = max(slow[1], slow[2])
    slow_share = slow[0] / (nothing + largest)
    fast_share = fast[0] / (nothing + max(fast[1], fast[2]))
    doubted, ignored, since, lasting = check.doubted, check.ignored, check.since, check.proven
    smaller, larger = min(fast[1], fast[2]), max(fast[1], fast[2])
    equal = fast[0] < EQUAL * (least + larger)
    if fast_share > ACQUITTED:
        lasting = 0.0
    elif smaller > PROOF * PROOF * (least if equal else nothing):
        lasting += dt
    if doubted == 0.0 and fast_share > DOUBTED:
        doubted = 1.0
    elif fast_share < CLEARED:
        doubted = 0.0
    needed = check.needed
    if ignored == 0.0 and slow_share > CONDEMNED:
        if check.total > 0.0 and since < RELAPSE:
            needed = min(RELAPSE_FACTOR * needed, LONGEST_PROOF)
        ignored, since = 1.0, 0.0
    elif ignored > 0.0 and lasting > needed:
        ignored, since, slow = 0.0, 0.0, fast
    return WheelCheck(
        1.0,
        check.travelled,
        check.swing,
        check.turning,
        check.acceleration,
        check.rolled_slow,
        check.rolled_mean,
        check.felt_mean,
        check.felt,
        check.felt_smooth,
        slow,
        fast,
        check.waiting,
        lasting,
        doubted,
        ignored,
        since,
        check.total,
        check.steps,
        check.unsure,
        needed,
    )


def _averaged(
    mean: tuple[float, float, float], now: tuple[float, float, float], share: float
) -> tuple[float, float, float]:
    return (
        mean[0] + share * (now[0] - mean[0]),
        mean[1] + share * (now[1] - mean[1]),
        mean[2] + share * (now[2] - mean[2]),
    )
