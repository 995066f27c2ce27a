"""A filter on a live stream with a monitor beside it, which also starts it afresh."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ..filters.base import Filter, estimate_of, turned
from ..robot import Robot
from ..samples import (
    OVERTURNED,
    RESTART_GAP,
    CorrectedSample,
    TiltEstimate,
    nearest,
    published,
)
from .step_code import StepCode
from .tilt_filter import TiltFilter
from .validity import (
    CLEARED_STDDEV,
    VALID_STDDEV,
    Watch,
    begin,
    certain,
    in_doubt,
    restarted,
    watch,
)

SELF_JUDGED = ("ins_odometer",)
"""Filters that make up for saturated sensors by themselves and come back to gravity."""


class WatchedFilter(TiltFilter):
    """One filter, judged at every sample and started afresh where it has gone astray."""

    _interpreted_state: Any | None = None
    _code: StepCode | None = None
    _in_code = False
    """Whether state and judgement lie with the machine code."""
    _seen: tuple[Any, Watch] | None = None
    """What was read of them since the latest sample."""
    _judged: tuple[float, ...] = ()
    """Its latest results: estimate, trusted, astray, doubt, missed, certain for."""

    def __init__(
        self,
        entry: Filter,
        values: Mapping[str, float] | None = None,
        robot: Robot | None = None,
        valid_stddev: float = VALID_STDDEV,
    ) -> None:
        """Prepare `entry` as `TiltFilter` does.

        Args:
            entry: the filter.
            values: parameter values; defaults for the others.
            robot: geometry, for filters that need it.
            valid_stddev: deviation above which the tilt is not trusted [rad].

        Raises:
            ConfigurationError: a parameter is unknown or out of bounds.
        """
        super().__init__(entry, values, robot)
        self._valid_stddev = valid_stddev
        self.restarts = 0
        """How often the filter disagreed with the samples and was started afresh."""
        self._lost = 0.0
        self._interpreted_watch: Watch | None = None
        self._self_judged = entry.name in SELF_JUDGED

    def use(self, code: StepCode | None) -> None:
        """Step by machine code from the next sample on, or interpreted again; same numbers."""
        self._leave()
        self._code = code

    def _leave(self) -> None:
        """Take state and judgement back from the machine code."""
        if self._in_code and self._code is not None:
            self._interpreted_state, self._interpreted_watch = self._looked_at()
            self._in_code = False

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy goes on from: interpreted, with the same numbers."""
        state, watched = self._looked_at()
        own = {"_interpreted_state": state, "_interpreted_watch": watched, "_seen": None}
        return {**self.__dict__, **own, "_code": None, "_in_code": False}

    def _looked_at(self) -> tuple[Any | None, Watch | None]:
        """Return state and judgement; where they lie with the machine code, they stay there."""
        if not self._in_code or self._code is None:
            return self._interpreted_state, self._interpreted_watch
        if self._seen is None:
            self._seen = self._code.state()
        return self._seen

    @property
    def state(self) -> Any | None:
        """State of the filter; None before the first sample."""
        return self._looked_at()[0]

    @state.setter
    def state(self, state: Any | None) -> None:
        self._leave()
        self._interpreted_state = state

    @property
    def _watch(self) -> Watch | None:
        return self._looked_at()[1]

    @_watch.setter
    def _watch(self, now: Watch | None) -> None:
        self._leave()
        self._interpreted_watch = now

    @property
    def valid_stddev(self) -> float:
        """Deviation above which the tilt is not trusted [rad]."""
        return self._valid_stddev

    @valid_stddev.setter
    def valid_stddev(self, limit: float) -> None:
        self._valid_stddev = limit
        self._change_code()

    @property
    def trusted(self) -> bool:
        """Whether neither the samples nor its own deviation leave the latest estimate in doubt."""
        if self._in_code:
            return self._judged[4] > 0.0 and self._judged[8] >= 0.0
        now = self._watch
        return now is not None and now.judgement.trusted > 0.0 and certain(now)

    @property
    def doubted(self) -> bool:
        """Whether the samples leave the latest estimate in doubt, whatever its own deviation."""
        if self._in_code:
            return self._judged[4] == 0.0
        return self._watch is not None and self._watch.judgement.trusted == 0.0

    @property
    def doubt(self) -> float:
        """Variance of the latest estimate by what the samples did not show [rad^2]."""
        if self._in_code:
            return self._judged[6]
        return 0.0 if self._watch is None else self._watch.judgement.doubt

    @property
    def lost(self) -> int:
        """Samples that gaps had room for."""
        return int(self._lost + (0.0 if self._watch is None else self._watch.stream.lost))

    def step(self, sample: CorrectedSample) -> TiltEstimate:
        """Take one sample; return the estimate at its stamp, within half a turn of zero."""
        estimate = self._step(sample)
        if abs(estimate.tilt) > math.pi:
            return estimate._replace(tilt=published(estimate.tilt))
        return estimate

    def _step(self, sample: CorrectedSample) -> TiltEstimate:
        if self._code is not None and 0.0 < sample.dt <= RESTART_GAP and self._enter(self._code):
            return self._compiled_step(self._code, sample)
        state, before = self.state, self._watch
        if state is not None and abs(state.tilt) > OVERTURNED:
            sample = sample._replace(angle=nearest(sample.angle, state.tilt))
        estimate = super().step(sample)
        if before is None or state is None or sample.dt > RESTART_GAP:
            self._begin(sample, estimate, unknown=state is not None and sample.dt > RESTART_GAP)
            return estimate
        if sample.dt <= 0.0:
            return estimate
        now = watch(before, sample, estimate, self.valid_stddev, self._self_judged)
        return self._put_right(now, sample, estimate)

    def _put_right(
        self, now: Watch, sample: CorrectedSample, estimate: TiltEstimate
    ) -> TiltEstimate:
        """Do what the judgement asks for; return the estimate that holds then."""
        if now.missed != 0.0:
            estimate = self._make_up(now, sample)
            now = now._replace(tilt=estimate.tilt)
        if (
            now.judgement.astray > 0.0
            and now.rest.wrong > 0.0
            and not self.entry.estimates_gyro_bias
        ):
            now = now._replace(
                judgement=now.judgement._replace(astray=0.0)
            )  # it would go astray by the same bias again
        elif now.judgement.astray > 0.0:
            estimate = self._restart(now, sample)
            now = restarted(now, self.valid_stddev)
        self._watch = now
        return estimate

    def _enter(self, code: StepCode) -> bool:
        """Hand state and judgement to the machine code, where there are any yet and they fit."""
        if self._in_code:
            return True
        state, watched = self._interpreted_state, self._interpreted_watch
        if state is None or watched is None:
            return False
        self._seen = None
        self._in_code = code.begin((self._coefficients, self._valid_stddev), (state, watched))
        if not self._in_code:
            self._code = None
        judgement = watched.judgement
        judged = (judgement.trusted, 0.0, judgement.doubt, 0.0, watched.certainty.time)
        self._judged = (*estimate_of(state), *judged)
        return self._in_code

    def _change_code(self) -> None:
        """Give the machine code the present coefficients; where they fit, the state stays there."""
        if not self._in_code or self._code is None:
            return
        if not self._code.change((self._coefficients, self._valid_stddev)):
            self._leave()

    def _compiled_step(self, code: StepCode, sample: CorrectedSample) -> TiltEstimate:
        tilt = self._judged[0]
        if abs(tilt) > OVERTURNED:
            sample = sample._replace(angle=nearest(sample.angle, tilt))
        self._judged = judged = code.step(sample)
        self._seen = None
        estimate = TiltEstimate(*judged[:4])
        if (judged[5] > 0.0 or judged[7] != 0.0) and (now := self._watch) is not None:
            return self._put_right(now, sample, estimate)
        return estimate

    def _begin(self, sample: CorrectedSample, estimate: TiltEstimate, unknown: bool) -> None:
        if self._watch is not None:
            self._lost += self._watch.stream.lost
        self._watch = begin(sample, estimate, unknown, self._valid_stddev, self._self_judged)

    def _make_up(self, now: Watch, sample: CorrectedSample) -> TiltEstimate:
        """Add what a saturated gyro did not show; the filter else goes on as it was."""
        state = turned(self.state, now.missed)
        if state is not None:
            self.state = state
            return estimate_of(state)
        before = estimate_of(self.state)
        variance = before.tilt_variance + now.judgement.doubt
        return self.reset(
            before._replace(tilt=before.tilt + now.missed, tilt_variance=variance), sample
        )

    def _restart(self, now: Watch, sample: CorrectedSample) -> TiltEstimate:
        """Go on from the reference, with the gyro bias from before the doubt."""
        self.restarts += 1
        reference, bias = now.reference, now.judgement.bias
        rate = sample.gyro_y - bias
        return self.reset(TiltEstimate(reference.tilt, rate, bias, reference.variance), sample)

    def use_parameters(self, parameters: Any) -> None:
        """Use other parameters, which `entry.configure` has made, from the next sample on."""
        super().use_parameters(parameters)
        self._change_code()

    def use_robot(self, robot: Robot) -> None:
        """Use another geometry from the next sample on; the state stays."""
        super().use_robot(robot)
        self._change_code()

    def succeed(self, other: WatchedFilter, sample: CorrectedSample) -> None:
        """Go on from another filter's estimate at the stamp of `sample`, judgement and counts.

        A trusted estimate without a variance has the one below which trust returns, so that a
        filter which judges itself does not begin as if nothing were known. One that is not certain
        of its tilt leaves its variance as doubt, of which a successor may state nothing.
        """
        self.restarts, self._lost = other.restarts, other._lost
        estimate, now = other.estimate, other._watch
        if estimate is not None:
            if other.trusted and estimate.tilt_variance == 0.0:
                estimate = estimate._replace(tilt_variance=CLEARED_STDDEV * CLEARED_STDDEV)
            self.reset(estimate, sample)
            if now is not None and not certain(now):
                now = in_doubt(now, estimate.tilt_variance)
            self._watch = now

    def forget(self) -> None:
        """Start afresh at the next sample."""
        super().forget()
        if self._watch is not None:
            self._lost += self._watch.stream.lost
        self._watch = None
