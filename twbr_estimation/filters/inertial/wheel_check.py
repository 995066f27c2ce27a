"""Whether the wheels move as the accelerometer feels: checked at every sample, not believed.

Two velocities of the sensor along the robot's heading are compared, one from the encoders and
one from the accelerometer, the latter free of gravity as `vertical` has it. Both pass the same
filters, which leave the band in which neither a tilt that is a little wrong nor the steps of an
encoder count. The mean square of their difference, over that of the larger one, is 1 where the
wheels stand while the body is carried, or run while it is held, 4 where a sign is wrong, a
quarter where one of two is frozen, and a few hundredths where they roll. No covariance of the
navigation has a part in it: a lie that the navigation has learnt would vouch for itself.
"""

from typing import NamedTuple

from ...samples import FASTEST_WHEEL, CorrectedSample
from .aiding import Geometry, whole_turns_less
from .encoder_steps import FIRST_STEP, Steps, stepped
from .navigation import InertialReading
from .strapdown import Matrix, Vector, heading_of, rotated

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
EVIDENCE = 1.5
"""Least slow square that condemns, in that of a velocity that counts for nothing."""
CONDEMNED, ACQUITTED = 0.18, 0.08
"""Share of the slow squares above which wheels are ignored; below the second one nothing speaks
against them, and of the fast squares it is proof."""
PROVEN, RETURN = 1.0, 1.0
"""So long must the wheels be right to be proven, and to be believed again once they were wrong
[s]."""
RELAPSE, RELAPSE_FACTOR, LONGEST_PROOF = 20.0, 4.0, 60.0
"""Wheels that are wrong again within the first [s] must be right so many times longer, at most
the last [s]."""
RIGHT_ONCE = 0.1
"""Wheels that were right for so long have the right sign, unit and gear [s]."""
PROOF = 2.0
"""A motion must exceed what counts for nothing so many times to prove anything."""
EQUAL = 0.02
"""Share of the fast squares below which the velocities are the same: an unsure vertical excuses a
difference, but where there is none it is right as well."""
FORGIVEN = 1.0
"""After a clipped sensor nothing is compared for so long [s]."""
STEP_TIME = 0.08
"""Steps of an encoder over this time are a velocity that counts for nothing [s]."""
BETWEEN = 2.0
"""Acceleration between two samples that none of them shows [m/s^2]."""
MISREAD, MISREAD_TIME = 6.5, 2.0
"""So many turns that no wheel can make within the second [s] are misread counts; more are a wrong
unit."""
PROBATION = 0.3
"""The velocities need so long to begin [s]."""


class Velocities(NamedTuple):
    """The two velocities, and what they are made of."""

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


class Trust(NamedTuple):
    """What is held of the wheels."""

    proven: float
    """For how long they have been right [s]."""
    doubted: float
    """1 while they are left out for the moment, else 0."""
    ignored: float
    """1 while they are ignored, else 0."""
    since: float
    """How long ago that began or ended [s]."""
    total: float
    """How long they were ignored in all [s]."""
    needed: float
    """How long they must be right before they are believed again [s]."""
    longest: float
    """The longest that they have been right at a time [s]."""


class WheelCheck(NamedTuple):
    """What the comparison remembers."""

    known: float
    """1 where the distance is known, else 0."""
    velocities: Velocities
    slow: tuple[float, float, float]
    """Mean squares of difference, wheels' and accelerometer's velocity [(m/s)^2]."""
    fast: tuple[float, float, float]
    """The same over a shorter time."""
    waiting: float
    """Time left in which nothing is compared [s]."""
    trust: Trust
    steps: Steps
    """Of the encoder."""
    unsure: float
    """Largest variance of the tilt that the velocities remember [rad^2]."""
    misread: float
    """How many turns of late no wheel can have made."""


def begin_check(unsure: float = 0.0) -> WheelCheck:
    """Begin with wheels that have proven nothing, at a variance of the tilt [rad^2]."""
    zeros = (0.0, 0.0, 0.0)
    return WheelCheck(
        known=0.0,
        velocities=Velocities(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        slow=zeros,
        fast=zeros,
        waiting=PROBATION,
        trust=Trust(0.0, 0.0, 0.0, 0.0, 0.0, needed=RETURN, longest=0.0),
        steps=Steps(0.0, 0.0, FIRST_STEP),
        unsure=unsure,
        misread=0.0,
    )


def believed(check: WheelCheck) -> bool:
    """Whether the wheels are used."""
    return check.trust.doubted == 0.0 and check.trust.ignored == 0.0


def clipped_of_late(check: WheelCheck) -> bool:
    """Whether a sensor was clipped, or silent, a moment ago."""
    return check.waiting > PROBATION


def proven(check: WheelCheck) -> bool:
    """Whether the wheels have proven right by moving as the accelerometer felt."""
    return check.trust.proven > PROVEN and check.waiting <= 0.0 and believed(check)


def misleading(check: WheelCheck) -> bool:
    """Whether wheels that have been right slip within their first moments.

    That leads the navigation astray before it knows anything; later it knows better.
    """
    trust = check.trust
    early = trust.total == 0.0 and trust.since < SLOW
    return early and were_right_once(check) and not trustworthy(check)


def were_right_once(check: WheelCheck) -> bool:
    """Whether the wheels have the right sign, unit and gear, though they may not be proven."""
    return check.trust.longest > RIGHT_ONCE


def were_right(check: WheelCheck) -> bool:
    """Whether the wheels have proven right at any time."""
    return check.trust.longest > PROVEN


def trustworthy(check: WheelCheck) -> bool:
    """Whether nothing speaks against the wheels of late."""
    largest = max(check.slow[1], check.slow[2]) + SMALLEST * SMALLEST
    return check.slow[0] < ACQUITTED * largest


def restarted(check: WheelCheck) -> WheelCheck:
    """Return the check with velocities that begin afresh, as the attitude was replaced."""
    return with_trust(check, 0.0, check.trust)


def condemned(check: WheelCheck) -> WheelCheck:
    """Return the check with wheels that are ignored from now on, whatever the velocities show."""
    trust = check.trust
    if trust.ignored > 0.0:
        return check
    return with_trust(check, check.known, ignoring(trust, 0.0, trust.doubted))


def ignoring(trust: Trust, proven: float, doubted: float) -> Trust:
    """Return the trust that begins to ignore the wheels."""
    needed = trust.needed
    if trust.total > 0.0 and trust.since < RELAPSE:
        needed = min(RELAPSE_FACTOR * needed, LONGEST_PROOF)
    return Trust(proven, doubted, 1.0, 0.0, trust.total, needed, trust.longest)


def with_trust(check: WheelCheck, known: float, trust: Trust) -> WheelCheck:
    """Return the same velocities and squares with another trust; see `WheelCheck`."""
    return WheelCheck(
        known,
        check.velocities,
        check.slow,
        check.fast,
        check.waiting,
        trust,
        check.steps,
        check.unsure,
        check.misread,
    )


def _later(trust: Trust, dt: float) -> Trust:
    return Trust(
        trust.proven,
        trust.doubted,
        trust.ignored,
        trust.since + dt,
        trust.total + trust.ignored * dt,
        trust.needed,
        trust.longest,
    )


def checked(
    check: WheelCheck,
    sample: CorrectedSample,
    now: InertialReading,
    variance: float,
    lever_left: float,
    geometry: Geometry,
    still: bool,
    blinded: bool,
) -> WheelCheck:
    """Return the check one sample later.

    Args:
        check: one sample ago.
        sample: the new one.
        now: what the navigation made of it.
        variance: of the tilt [rad^2].
        lever_left: what to add to the place of the lever arm to the left [m].
        geometry: of the robot.
        still: whether the body lies still.
        blinded: whether a sensor was clipped, or silent, at this sample.
    """
    moved_on = compared(
        check,
        sample,
        now.body,
        now.tilt,
        now.rate,
        BAND,
        variance,
        lever_left,
        geometry,
        still,
        blinded,
    )
    if moved_on.waiting > 0.0:
        return moved_on
    least = least_square(moved_on, sample.dt, geometry)
    nothing = least + PER_TILT * PER_TILT * moved_on.unsure
    return _judged(moved_on, least, nothing, still, sample.dt)


def least_square(check: WheelCheck, dt: float, geometry: Geometry) -> float:
    """Return the square of a velocity that counts for nothing, where the vertical is known."""
    step = geometry.wheel_radius * check.steps.size / STEP_TIME
    between = BETWEEN * dt
    return SMALLEST * SMALLEST + step * step + between * between


def compared(
    check: WheelCheck,
    sample: CorrectedSample,
    body: Matrix,
    tilt: float,
    rate: Vector,
    left_out: float,
    variance: float,
    lever_left: float,
    geometry: Geometry,
    still: bool,
    blinded: bool,
) -> WheelCheck:
    """Return the check with velocities and squares one sample later; nothing is judged.

    Slower changes than in `left_out` [s] are left out, twice; see `checked` for the others.
    """
    dt, before = sample.dt, check.velocities
    wheel_radius, lever = geometry.wheel_radius, geometry.lever
    lever = (lever[0], lever[1] + lever_left, lever[2])
    forward, left = heading_of(body)
    arm = rotated(body, lever)
    ahead, aside = arm[0] * forward + arm[1] * left, arm[1] * forward - arm[0] * left
    yaw = body[6] * rate[0] + body[7] * rate[1] + body[8] * rate[2]
    force = rotated(body, (sample.accel_x, sample.accel_y, sample.accel_z))
    distance = wheel_radius * (sample.wheel_angle + geometry.on_body * tilt) + ahead
    acceleration = force[0] * forward + force[1] * left
    acceleration += yaw * (yaw * ahead + (aside - before.swing) / dt)
    if still:
        acceleration = 0.0
    if sample.wheel_count == 0.0 or check.known == 0.0 or blinded:
        afresh = Velocities(
            distance,
            aside,
            yaw * aside,
            acceleration,
            before.rolled_slow,
            before.rolled_mean,
            before.felt_mean,
            before.felt,
            before.felt_smooth,
        )
        return _paused(check, afresh, blinded, sample)
    smooth, band = dt / (SMOOTHED + dt), dt / (left_out + dt)
    unsure = max(variance, check.unsure * max(1.0 - dt / SLOW, 0.0))
    fresh = still and check.waiting > 0.0
    jump, misread = 0.0, check.misread * max(1.0 - dt / MISREAD_TIME, 0.0)
    change = sample.wheel_angle - check.steps.angle
    if abs(change) > FASTEST_WHEEL * dt:
        misread += 1.0
        jump = wheel_radius * change if misread < MISREAD else 0.0
    apart = distance - before.travelled - jump
    turn = apart - whole_turns_less(apart, geometry) if body[8] < 0.0 else 0.0
    moved = smooth * (apart - turn)
    turning = before.turning + smooth * (yaw * aside - before.turning)
    velocity = moved / dt - before.turning
    rolled_slow = before.rolled_slow + band * (velocity - before.rolled_slow)
    rolled = velocity - rolled_slow
    rolled_mean = before.rolled_mean + band * (rolled - before.rolled_mean)
    rolled -= rolled_mean
    mean = 0.5 * (acceleration + before.acceleration)
    felt_mean = before.felt_mean + band * (mean - before.felt_mean)
    felt = (before.felt + dt * (mean - felt_mean)) * (1.0 - band)
    felt_smooth = before.felt_smooth + smooth * (felt - before.felt_smooth)
    if fresh:  # a body that lies still has not accelerated, however unsure its vertical is
        unsure = felt = felt_mean = felt_smooth = 0.0
    slow, fast = check.slow, check.fast
    if check.waiting - dt <= 0.0:
        difference = rolled - felt_smooth
        squares = (difference * difference, rolled * rolled, felt_smooth * felt_smooth)
        slow = _averaged(slow, squares, dt / SLOW)
        fast = _averaged(fast, squares, dt / FAST)
    return WheelCheck(
        known=1.0,
        velocities=Velocities(
            before.travelled + jump + turn + moved,
            aside,
            turning,
            acceleration,
            rolled_slow,
            rolled_mean,
            felt_mean,
            felt,
            felt_smooth,
        ),
        slow=slow,
        fast=fast,
        waiting=check.waiting - dt,
        trust=_later(check.trust, dt),
        steps=stepped(check.steps, sample.wheel_angle),
        unsure=unsure,
        misread=misread,
    )


def _paused(
    check: WheelCheck, afresh: Velocities, blinded: bool, sample: CorrectedSample
) -> WheelCheck:
    """Begin the velocities afresh: there is nothing to compare."""
    return WheelCheck(
        known=1.0 if sample.wheel_count > 0.0 else 0.0,
        velocities=afresh,
        slow=check.slow,
        fast=check.fast,
        waiting=max(check.waiting - sample.dt, FORGIVEN if blinded else PROBATION),
        trust=_later(check.trust, sample.dt),
        steps=Steps(sample.wheel_angle, 0.0, check.steps.size),
        unsure=check.unsure,
        misread=check.misread,
    )


def _judged(check: WheelCheck, least: float, nothing: float, still: bool, dt: float) -> WheelCheck:
    """Judge by the squares.

    Args:
        check: with the squares of this sample.
        least: square of a velocity that counts for nothing, where the vertical is known.
        nothing: the same with what the vertical is unsure by.
        still: whether the body lies still, which proves nothing.
        dt: [s].
    """
    slow, fast, trust = check.slow, check.fast, check.trust
    slow_share = slow[0] / (nothing + max(slow[1], slow[2]))
    fast_share = fast[0] / (nothing + max(fast[1], fast[2]))
    doubted, lasting = trust.doubted, trust.proven
    smaller, larger = min(fast[1], fast[2]), max(fast[1], fast[2])
    equal = fast[0] < EQUAL * (least + larger)
    if fast_share > ACQUITTED:
        lasting = 0.0
    elif not still and smaller > PROOF * PROOF * (least if equal else nothing):
        lasting += dt
    if doubted == 0.0 and fast_share > DOUBTED:
        doubted = 1.0
    elif fast_share < CLEARED:
        doubted = 0.0
    longest = max(lasting, trust.longest)
    trust = Trust(lasting, doubted, trust.ignored, trust.since, trust.total, trust.needed, longest)
    if trust.ignored == 0.0 and slow_share > _limit(trust) and slow[0] > EVIDENCE * least:
        trust = ignoring(trust, lasting, doubted)
    elif trust.ignored > 0.0 and lasting > trust.needed:
        trust = Trust(lasting, doubted, 0.0, 0.0, trust.total, trust.needed, longest)
        slow = fast
    return WheelCheck(
        1.0,
        check.velocities,
        slow,
        fast,
        check.waiting,
        trust,
        check.steps,
        check.unsure,
        check.misread,
    )


def _limit(trust: Trust) -> float:
    """Return the share of the slow squares that condemns.

    Squares that have been averaged for less than their time stand for less than they are: what
    is not seen yet counts as right.
    """
    return CONDEMNED * max(SLOW / trust.since, 1.0) if trust.total == 0.0 else CONDEMNED


def _averaged(
    mean: tuple[float, float, float], now: tuple[float, float, float], share: float
) -> tuple[float, float, float]:
    return (
        mean[0] + share * (now[0] - mean[0]),
        mean[1] + share * (now[1] - mean[1]),
        mean[2] + share * (now[2] - mean[2]),
    )
