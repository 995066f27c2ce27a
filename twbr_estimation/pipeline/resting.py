"""What a robot at rest shows: its tilt, and the bias of its gyro.

For as long as the accelerometer's angle and the rate stay as they are, the gyro has to read what
the angle turns, and what is left is a bias. `begin` and `continued` are pure functions on named
tuples, as those of `unseen`.
"""

from typing import NamedTuple

from ..samples import CorrectedSample, gravity_excess, wrapped

REST_TIME, LONGEST = 1.0, 10.0
"""Time over which the accelerometer has to be steady, and after which the sums begin again [s]."""
SMOOTHED = 0.05
"""Time constant over which its angle and the specific force are averaged first [s], so that a noisy
accelerometer can be steady, too."""
STEADY = 0.06
"""Distance of that angle from the mean [rad] up to which the accelerometer is steady."""
STEADY_SHARE = 0.05
"""Share of gravity by which that specific force may be longer or shorter then."""
STEADY_RATE = 0.03
"""Distance of the rate from its mean [rad/s] up to which the body rests, whatever its bias."""
SLOPE = 0.02
"""Change of the accelerometer's angle [rad/s] beyond which that sways, or the body turns."""


class RestSums(NamedTuple):
    """Sums over the time for which the accelerometer has been steady."""

    time: float
    """[s]."""
    angle: float
    """The accelerometer's at the beginning [rad]; the others count from it."""
    shift: float
    """Sum of the angle times the time step [rad s]."""
    moment: float
    """The same, times the time since the beginning [rad s^2]."""
    turned: float
    """What the gyro has turned [rad]."""
    found: float
    """1 where that is `REST_TIME` or more, and the angle does not change, else 0."""
    wrong: float
    """1 where the last rest has shown that the filter ignores a bias, 0.5 where the present one
    may show it, else 0."""
    off: float
    """The angle, averaged over `SMOOTHED` [rad]."""
    excess: float
    """The share of gravity by which the specific force is longer, averaged likewise."""


class Shown(NamedTuple):
    """What a rest shows."""

    tilt: float
    """[rad]."""
    bias: float
    """Of the gyro [rad/s]."""


def begin(sample: CorrectedSample) -> RestSums:
    """Start with a first sample."""
    return _afresh(sample, 0.0, gravity_excess(sample))


def _afresh(sample: CorrectedSample, wrong: float, excess: float) -> RestSums:
    return RestSums(0.0, sample.angle, 0.0, 0.0, 0.0, 0.0, wrong, 0.0, excess)


def continued(before: RestSums, sample: CorrectedSample, turned: float, blind: bool) -> RestSums:
    """Take one sample.

    Args:
        before: what is known of the samples before.
        sample: the reading.
        turned: what the gyro has turned since the one before [rad].
        blind: whether it hides something.
    """
    dt, off = sample.dt, wrapped(sample.angle - before.angle)
    share = dt / (dt + SMOOTHED)
    excess = before.excess + share * (gravity_excess(sample) - before.excess)
    smooth = before.off + share * (off - before.off)
    if before.time > LONGEST or blind or abs(excess) > STEADY_SHARE:
        return _afresh(sample, before.wrong, excess)
    time, shift = before.time + dt, before.shift + off * dt
    turn, moment = before.turned + turned, before.moment + off * dt * (time - 0.5 * dt)
    if abs(smooth - shift / time) > STEADY or abs(turned / dt - turn / time) > STEADY_RATE:
        return _afresh(sample, before.wrong, excess)
    found = 1.0 if time >= REST_TIME and abs(_slope(time, shift, moment)) < SLOPE else 0.0
    return RestSums(time, before.angle, shift, moment, turn, found, before.wrong, smooth, excess)


def _slope(time: float, shift: float, moment: float) -> float:
    """Return the slope of a straight line through the angles [rad/s]."""
    return 12.0 * (moment - 0.5 * time * shift) / (time * time * time)


def shown_by(rest: RestSums) -> Shown:
    """Return what a rest that was `found` shows: a straight line through the angles."""
    time, mean = rest.time, rest.shift / rest.time
    slope = _slope(time, rest.shift, rest.moment)
    tilt = wrapped(rest.angle + mean + 0.5 * time * slope)
    return Shown(tilt, rest.turned / time - slope)


def judged_wrong(rest: RestSums, wrong: float) -> RestSums:
    """Return the same sums with another judgement of the filter, 1 or 0; see `RestSums`."""
    return RestSums(
        rest.time,
        rest.angle,
        rest.shift,
        rest.moment,
        rest.turned,
        rest.found,
        wrong,
        rest.off,
        rest.excess,
    )
