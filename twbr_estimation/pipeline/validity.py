"""Whether an estimate deserves trust, judged by the samples and not by the filter.

A gap, a saturated sensor and a frozen one leave a rotation unseen. The monitor bounds it, and
follows beside the filter a reference of its own: the accelerometer's angle carried by the gyro,
averaged since the last cause of doubt. Where both agree, the doubt ends; where they do not, the
filter has to start afresh from the reference.

`begin`, `watch` and `restarted` are pure functions on named tuples, so that a batch can compile
them.
"""

import math
from typing import NamedTuple

from ..samples import (
    LYING,
    RESTART_GAP,
    CorrectedSample,
    TiltEstimate,
    gravity_excess,
    is_silent,
    shows_gravity,
    shows_rest,
    wrapped,
)
from . import resting, spinning, unseen
from .resting import RestSums, continued, judged_wrong, shown_by
from .spinning import LED, Spin, leaned, spun
from .unseen import (
    ACCELERATION,
    FREEZE,
    Stream,
    follow,
    is_gap,
    may_be_level,
    misled,
    uncertainty,
    unseen_rotation,
)

VALID_STDDEV = 0.2
"""Deviation of a tilt [rad] above which it is not trusted, unless a user sets another."""
SUSTAINED_STDDEV, SUSTAINED_SHARE, SUSTAINED_TIME = 0.06, 0.3, 1.0
"""The filter's own deviation [rad] above which its tilt is trusted for so long [s] only, at least
that share of the limit above: longer than a push, it is no transient but what is not known."""
EARNED_STDDEV, REGAINED_STDDEV = 0.08, 0.05
"""The filter's own deviation [rad] below which its tilt is trusted first, and again."""
EARNED_TIME, FIRST_STDDEV = 3.0, 0.12
"""A tilt that has been trusted again for less than the first [s] is lost at that deviation, too;
one that is trusted for the first time, above the second [rad]: a robot may be pushed at once."""
PROVEN_STDDEV, PROVEN_TIME = 0.025, 5.0
"""The same for so long [s] after a filter that judges itself has lost its first trust before that
was earned: what misled it, a throw or wrong wheels, misleads its deviation, too."""
LYING_STDDEV = 0.05
"""The filter's own deviation [rad] above which the tilt of a robot beyond `LYING` is not trusted;
it does not balance, and loses nothing."""
CLEARED_STDDEV = 0.05
"""Doubt [rad] below which a tilt that was not trusted is trusted again."""
CAUSE = 0.0125
"""Rotation unseen in one sample [rad] from which on it is a cause of doubt."""
CORRELATION = 0.2
"""Time over which the accelerometer's disturbances stay alike [s]."""
SCATTER_MEMORY = 0.05
"""Time over which their size is measured [s]."""
FLOOR = 0.01
"""Smallest scatter of the accelerometer's angle [rad]."""
FIRST_SCATTER = 0.15
"""Scatter assumed after a cause of doubt [rad]."""
DRIFT = 1e-4
"""Growth of the reference's variance by the gyro's errors [rad^2/s]."""
TURNING = 0.01
"""The same for a turn about the other axes, per square of its rate [rad^2/s per (rad/s)^2]."""
KNOWN = 0.1
"""Deviation of the reference [rad] below which a filter may start afresh from it."""
REST_KNOWN = 0.025
"""The same where the robot rests and the filter is not trusted."""
DISAGREEMENT = 0.06
"""Distance of the filter from the reference [rad] that counts, beyond three deviations."""
REST_DISAGREEMENT = 0.03
"""The same where the robot rests."""
REST_SCATTER, REST_RATE = 4e-4, 0.1
"""Mean square of the disturbances [rad^2] and rate [rad/s] below which it does."""
LAG = 2.0
"""How many times what a filter is known to miss in a silence counts as a deviation."""
BIAS_CHANGE = 0.02
"""Change of a gyro bias [rad/s] in a time of doubt that is taken back."""
BIAS_TIME = 2.0
"""Time of rest that shows a bias [s]; the turn of a body in a hand can look like one for less."""
SUSPECTED = 0.5
"""`RestSums.wrong` until then."""
SETTLED = 1.0
"""Time in which a filter that judges itself makes up for a gap [s]."""
AFTERMATH = 20.0
"""Time after a cause of doubt in which a disagreement is its consequence [s]."""
_UNKNOWN = math.pi**2


class Reference(NamedTuple):
    """The accelerometer's angle, carried by the gyro and averaged."""

    tilt: float
    """[rad]."""
    variance: float
    """[rad^2]."""
    scatter: float
    """Mean square of the accelerometer's disturbances [rad^2]."""


class BeforeSaturation(NamedTuple):
    """What held before the gyro was saturated, whose bound is replaced once that is over."""

    doubt: float
    """Deviation of the filter's tilt [rad]."""
    trusted: float
    variance: float
    """Of the reference [rad^2]."""


class Silence(NamedTuple):
    """A silence of the sensor, which is a gap in which the filter is stepped all the same."""

    time: float
    """For how long it has lasted [s]; 0 where there is none."""
    doubt: float
    """Variance of the filter's tilt before it [rad^2]."""


_NO_SILENCE = Silence(0.0, 0.0)
_NOTHING_KNOWN = BeforeSaturation(math.pi, 0.0, _UNKNOWN)
"""What held before a saturation that a silence is part of, or follows, or precedes."""


class Certainty(NamedTuple):
    """For how long the filter's own deviation has let its tilt count."""

    time: float
    """[s]; for how long it has not where below 0."""
    unsure: float
    """For how long the deviation has been above what may be sustained [s]."""
    lost: float
    """1 where it has let it count before, or anything may have happened since, else 0."""
    needed: float
    """Deviation below which it first does again [rad]."""


class Judgement(NamedTuple):
    """What is held of the filter."""

    doubt: float
    """Variance of its tilt by what went unseen [rad^2]."""
    trusted: float
    """1 where the estimate deserves trust, else 0."""
    astray: float
    """1 where it has to start afresh from the reference, else 0."""
    bias: float
    """Its gyro bias when there was last no doubt, or what a rest has shown since [rad/s]."""
    calm: float
    """Time since the last cause of doubt [s]."""


class Watch(NamedTuple):
    """What the monitor remembers from one sample to the next."""

    judgement: Judgement
    missed: float
    """Rotation that the filter has just missed and gets added [rad]; 0 almost always."""
    tilt: float
    """The filter's, when the sensor last said anything [rad]."""
    silence: Silence
    known: BeforeSaturation
    certainty: Certainty
    reference: Reference
    stream: Stream
    rest: RestSums
    spin: Spin


def begin(
    sample: CorrectedSample,
    estimate: TiltEstimate,
    unknown: bool,
    valid_stddev: float = VALID_STDDEV,
    self_judged: bool = False,
) -> Watch:
    """Start with a sample whose angle is all that is known.

    Args:
        sample: the first one, or the first after a time in which anything may have happened.
        estimate: the filter's.
        unknown: whether it is the latter, so that the tilt has to be confirmed first.
        valid_stddev: deviation above which the tilt is not trusted [rad].
        self_judged: whether the filter states by itself how well it knows its first tilt; else
            that has to be confirmed, too, unless the sample is one of a robot at rest.
    """
    variance = FIRST_SCATTER * FIRST_SCATTER
    certainty = Certainty(-1.0, 0.0, 1.0 if unknown else 0.0, EARNED_STDDEV)
    shown = self_judged or shows_gravity(sample)
    rests = shows_rest(sample, estimate.tilt, estimate.gyro_bias)
    doubt, trusted = _UNKNOWN if unknown else variance, not unknown and (self_judged or rests)
    calm = 0.0 if unknown else AFTERMATH
    return Watch(
        Judgement(doubt, 1.0 if trusted else 0.0, 0.0, estimate.gyro_bias, calm),
        0.0,
        estimate.tilt,
        _NO_SILENCE,
        BeforeSaturation(0.0, 0.0, 0.0),
        _certainty(certainty, estimate, 0.0, valid_stddev, self_judged),
        Reference(sample.angle, variance if shown else _UNKNOWN, variance),
        unseen.begin(sample),
        resting.begin(sample),
        spinning.begin(sample),
    )


def watch(
    before: Watch,
    sample: CorrectedSample,
    estimate: TiltEstimate,
    valid_stddev: float = VALID_STDDEV,
    self_judged: bool = False,
) -> Watch:
    """Judge the estimate at one sample.

    Args:
        before: what the sample before left.
        sample: the reading; its `dt` is above zero.
        estimate: what the filter made of it.
        valid_stddev: deviation above which the tilt is not trusted [rad].
        self_judged: whether the filter makes up for saturation and gaps by itself; then it is
            astray only where the robot rests and the reference is well known.

    Returns:
        The judgement. Where it is `astray`, the filter starts afresh and `restarted` follows.
    """
    if is_silent(sample):
        return _in_silence(before, sample, estimate, valid_stddev, self_judged)
    last, silent = before.judgement, before.silence.time > 0.0
    dt, known = sample.dt + before.silence.time, before.known
    stream = follow(before.stream, sample, dt)
    turn = dt * (0.5 * (sample.gyro_y + before.stream.gyro[1]) - last.bias)
    hidden = unseen_rotation(before.stream, stream, dt)
    pull, missed = wrapped(estimate.tilt - before.tilt - turn), 0.0
    if silent:
        bridged = dt <= RESTART_GAP and before.stream.saturated == 0.0
        missed, pull = -pull if bridged and not self_judged else 0.0, 0.0
    variance = before.silence.doubt if silent else last.doubt
    pulled = 0.0 if self_judged else misled(stream, sample, abs(pull))
    doubt = min(math.sqrt(variance) + hidden + pulled, math.pi)
    calm, scatter = last.calm + sample.dt, before.reference.scatter
    if hidden > CAUSE or (pulled > 0.0 and doubt > CAUSE):
        calm, scatter = 0.0, max(scatter, FIRST_SCATTER * FIRST_SCATTER)
    reference = _carried(before.reference, sample, turn, hidden, scatter)
    full = stream.saturated + stream.shocked > 0.0
    pending = stream.passed.readings == 1.0
    blind, rest, spin = full or pending or stream.frozen > FREEZE, before.rest, before.spin
    if not blind:
        reference = _averaged(reference, sample, min(sample.dt, 2.0 * stream.period))
    if not self_judged:
        turned = turn + last.bias * sample.dt
        spin = spun(spin, sample, estimate.tilt, pull)
        restless = blind or silent or leaned(spin) > 0.0 or is_gap(before.stream, dt)
        rest = continued(rest, sample, turned, restless)
    if stream.saturated > 0.0 and before.stream.saturated == 0.0:
        known = BeforeSaturation(math.sqrt(last.doubt), last.trusted, before.reference.variance)
    if silent and stream.saturated + stream.passed.readings > 0.0:
        known = _NOTHING_KNOWN
    judgement = Judgement(doubt * doubt, last.trusted, 0.0, last.bias, calm)
    judgement, reference = _turned(judgement, reference, spin)
    if stream.passed.readings == 2.0:
        judgement, reference = _passed(judgement, reference, known, stream, self_judged)
        missed += 0.0 if self_judged else stream.passed.rotation
    tilt = estimate.tilt
    if silent:  # what is judged is the tilt with what it gets added
        estimate = TiltEstimate(
            tilt + missed, estimate.rate, estimate.gyro_bias, estimate.tilt_variance
        )
    if rest.found > 0.0 or rest.wrong > 0.0:
        judgement, reference, rest = _rested(judgement, reference, rest, estimate)
    wrong = rest.wrong > 0.0
    return Watch(
        _judged(judgement, reference, stream, wrong, estimate, valid_stddev, self_judged),
        missed,
        tilt,
        _NO_SILENCE,
        known,
        _certainty(before.certainty, estimate, sample.dt, valid_stddev, self_judged),
        reference,
        stream,
        rest,
        spin,
    )


def _in_silence(
    before: Watch,
    sample: CorrectedSample,
    estimate: TiltEstimate,
    valid_stddev: float,
    self_judged: bool,
) -> Watch:
    """Judge the estimate while the sensor is silent.

    The filter stands still, or follows nothing; the next reading shows what it has missed.
    """
    last, began = before.judgement, before.silence
    silence = Silence(began.time + sample.dt, began.doubt if began.time > 0.0 else last.doubt)
    hidden = (LAG * abs(before.stream.gyro[1]) + ACCELERATION * silence.time) * sample.dt
    deviation = min(math.sqrt(last.doubt) + hidden, math.pi)
    trusted = last.trusted if deviation <= valid_stddev else 0.0
    calm = 0.0 if hidden > CAUSE else last.calm + sample.dt
    return Watch(
        Judgement(deviation * deviation, trusted, 0.0, last.bias, calm),
        0.0,
        before.tilt,
        silence,
        before.known,
        _certainty(before.certainty, estimate, sample.dt, valid_stddev, self_judged),
        before.reference,
        before.stream,
        before.rest,
        before.spin,
    )


def _turned(judgement: Judgement, reference: Reference, spin: Spin) -> tuple[Judgement, Reference]:
    """Return judgement and reference where something else may turn the robot."""
    lean = leaned(spin)
    variance = lean * lean
    if lean > 0.0 and abs(spin.led) > LED:
        doubt = max(judgement.doubt, variance)
        judgement = Judgement(doubt, 0.0, judgement.astray, judgement.bias, 0.0)
    variance = max(reference.variance, variance)
    return judgement, Reference(reference.tilt, variance, reference.scatter)


def _passed(
    judgement: Judgement,
    reference: Reference,
    known: BeforeSaturation,
    stream: Stream,
    self_judged: bool,
) -> tuple[Judgement, Reference]:
    """Replace the bound of a rotation beyond the gyro's range by what its end shows of it."""
    uncertain, tilt = uncertainty(stream.passed), wrapped(reference.tilt + stream.passed.rotation)
    if not self_judged and may_be_level(stream):
        return judgement, Reference(tilt, reference.variance, reference.scatter)
    deviation = min(math.sqrt(known.variance) + uncertain, math.sqrt(reference.variance))
    doubt = min(known.doubt + uncertain, math.pi)
    return (
        Judgement(doubt * doubt, known.trusted, judgement.astray, judgement.bias, judgement.calm),
        Reference(tilt, deviation * deviation, reference.scatter),
    )


def _rested(
    judgement: Judgement, reference: Reference, rest: RestSums, estimate: TiltEstimate
) -> tuple[Judgement, Reference, RestSums]:
    """Compare filter and reference with what a rest has shown, whenever that was.

    A gyro bias leads a filter that does not know it astray, and the reference, too, for as long
    as it lasts: such a filter is wrong until a rest shows otherwise, or it has learnt the bias.
    """
    doubt, trusted, astray, bias, calm = judgement
    wrong = rest.wrong
    if rest.found > 0.0:
        shown = shown_by(rest)
        distance = abs(wrapped(estimate.tilt - shown.tilt))
        apart = distance > 3.0 * FLOOR + REST_DISAGREEMENT
        biased = abs(shown.bias - bias) > BIAS_CHANGE or wrong == 1.0
        if apart and biased and wrong < 1.0 and rest.time < BIAS_TIME:
            doubt, trusted, wrong = max(doubt, distance * distance), 0.0, SUSPECTED
        else:
            wrong = 1.0 if apart and biased else 0.0
            if apart and (biased or trusted == 0.0):
                astray = 1.0 if wrong == 0.0 or rest.wrong < 1.0 else 0.0
                calm = 0.0 if biased else calm
                doubt, trusted, bias = max(doubt, distance * distance), 0.0, shown.bias
            if trusted == 0.0 and (apart or not biased):
                reference = Reference(shown.tilt, FLOOR * FLOOR, FLOOR * FLOOR)
    elif abs(estimate.gyro_bias - bias) < BIAS_CHANGE:
        wrong = 0.0
    return Judgement(doubt, trusted, astray, bias, calm), reference, judged_wrong(rest, wrong)


def _carried(
    before: Reference, sample: CorrectedSample, turn: float, hidden: float, scatter: float
) -> Reference:
    """Return the reference turned by the gyro's `turn` [rad], with what it may have missed."""
    sideways = sample.gyro_x * sample.gyro_x + sample.gyro_z * sample.gyro_z
    grown = before.variance + (DRIFT + TURNING * sideways) * sample.dt
    deviation = min(math.sqrt(grown) + hidden, math.pi)
    return Reference(wrapped(before.tilt + turn), deviation * deviation, scatter)


def _averaged(reference: Reference, sample: CorrectedSample, dt: float) -> Reference:
    """Return the reference with the accelerometer's angle, weighted by its disturbances.

    `dt` [s] is the time that the reading stands for, which a gap before it does not lengthen.
    """
    longer = gravity_excess(sample)
    innovation, variance = wrapped(sample.angle - reference.tilt), reference.variance
    disturbance = max(innovation * innovation - variance, 0.0) + longer * longer
    scatter = reference.scatter
    scatter += dt / (dt + SCATTER_MEMORY) * (disturbance - scatter)
    noise = (FLOOR * FLOOR + scatter) * max(CORRELATION / dt, 1.0)
    gain = variance / (variance + noise)
    tilt = wrapped(reference.tilt + gain * innovation)
    return Reference(tilt, (1.0 - gain) * variance, scatter)


def _judged(
    judgement: Judgement,
    reference: Reference,
    stream: Stream,
    wrong: bool,
    estimate: TiltEstimate,
    valid_stddev: float,
    self_judged: bool,
) -> Judgement:
    """Compare the filter with the reference where that is known well enough.

    `wrong` is whether the last rest has shown that the filter ignores a gyro bias.
    """
    doubt, before, astray, bias, calm = judgement
    distance = abs(wrapped(estimate.tilt - reference.tilt))
    deviation = math.sqrt(reference.variance)
    rests = reference.scatter < REST_SCATTER and abs(stream.gyro[1]) < REST_RATE
    apart = distance > 3.0 * deviation + (REST_DISAGREEMENT if rests else DISAGREEMENT)
    shown = reference.variance + distance * distance
    if calm > 0.0 and not (apart or wrong) and shown < doubt:
        doubt = shown
    if self_judged and calm > SETTLED and not apart:
        doubt = 0.0
    known = deviation < (REST_KNOWN if self_judged else KNOWN) and (rests or not self_judged)
    if apart and 0.0 < calm < AFTERMATH and known and not wrong:
        doubt, astray = max(doubt, distance * distance), 1.0
    trusted = 0.0 if wrong else _trusted(doubt, before, valid_stddev)
    if trusted == 0.0 and rests and deviation < REST_KNOWN and not (self_judged or wrong):
        astray = 1.0
    if trusted > before and abs(estimate.gyro_bias - bias) > BIAS_CHANGE and not self_judged:
        astray = 1.0
    elif trusted > 0.0 and doubt <= CLEARED_STDDEV * CLEARED_STDDEV:
        bias = estimate.gyro_bias
    return Judgement(doubt, trusted, astray, bias, calm)


def _trusted(doubt: float, before: float, valid_stddev: float) -> float:
    """Return 1 or 0; trust that was lost returns at a smaller doubt than it is lost at."""
    limit = valid_stddev if before > 0.0 else min(CLEARED_STDDEV, valid_stddev)
    return 1.0 if doubt <= limit * limit else 0.0


def _certainty(
    before: Certainty, estimate: TiltEstimate, dt: float, valid_stddev: float, self_judged: bool
) -> Certainty:
    """Return for how long the filter's own deviation has let its tilt count.

    What has just become certain may be so by a lie that is found out next, and a transient of a
    tilt that has long been certain must not stop the motors of a robot that balances.
    """
    limit = valid_stddev
    if before.time < 0.0:
        waited = before.time <= -PROVEN_TIME
        limit = min(max(before.needed, REGAINED_STDDEV) if waited else before.needed, limit)
    elif before.time <= EARNED_TIME:
        limit = min(EARNED_STDDEV if before.lost > 0.0 else FIRST_STDDEV, limit)
    if abs(wrapped(estimate.tilt)) > LYING:
        limit = min(LYING_STDDEV, limit)
    sustained, unsure = max(SUSTAINED_STDDEV, SUSTAINED_SHARE * valid_stddev), 0.0
    if before.time > EARNED_TIME and estimate.tilt_variance > sustained * sustained:
        unsure = before.unsure + dt
    if estimate.tilt_variance <= limit * limit and unsure <= SUSTAINED_TIME:
        time = before.time + dt if before.time >= 0.0 else 0.0
        return Certainty(time, unsure, before.lost, before.needed)
    if before.time < 0.0:
        return Certainty(before.time - dt, unsure, before.lost, before.needed)
    needed = before.needed
    if before.time > EARNED_TIME:
        needed = REGAINED_STDDEV
    elif self_judged and before.lost == 0.0:
        needed = PROVEN_STDDEV
    return Certainty(-dt, unsure, 1.0, needed)


def certain(now: Watch) -> bool:
    """Whether the filter's own deviation lets its tilt count."""
    return now.certainty.time >= 0.0


def in_doubt(now: Watch, variance: float) -> Watch:
    """Return what holds where a tilt has at least that variance [rad^2], as after a gap."""
    least, reference = FIRST_SCATTER * FIRST_SCATTER, now.reference
    doubt = max(now.judgement.doubt, variance)
    unsure, scatter = max(reference.variance, least), max(reference.scatter, least)
    return now._replace(
        judgement=now.judgement._replace(doubt=doubt, trusted=0.0, calm=0.0),
        known=BeforeSaturation(math.sqrt(doubt), 0.0, unsure),
        reference=reference._replace(variance=unsure, scatter=scatter),
    )


def restarted(now: Watch, valid_stddev: float = VALID_STDDEV) -> Watch:
    """Return what holds after the filter has started afresh from the reference."""
    judgement = now.judgement._replace(astray=0.0)
    if now.rest.wrong == 0.0:  # else it will go astray again, unless it takes the bias over
        doubt = now.reference.variance
        trusted = _trusted(doubt, judgement.trusted, valid_stddev)
        judgement = judgement._replace(doubt=doubt, trusted=trusted)
    return now._replace(judgement=judgement, tilt=now.reference.tilt)
