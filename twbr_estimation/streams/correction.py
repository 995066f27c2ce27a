"""From raw readings to corrected samples, live: guard stamps, pair wheels and motors, correct."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import replace

from ..checks.live import LiveChecks
from ..pipeline.correction import Corrector
from ..pipeline.oversampling import Oversampler
from ..pipeline.pairing import DEFAULT_WAIT
from ..pipeline.step_code import StepCode
from ..pipeline.temperature import at_temperature
from ..robot import Setup
from ..samples import CorrectedSample, Sample, is_saturated
from .guarded import UNKNOWN_TIME, GuardedPairing, StampedSamples
from .stamps import Verdict

COLDEST, HOTTEST = -60.0, 150.0
"""Temperatures that are believed [degC]."""


class CorrectionStream(GuardedPairing):
    """Corrects the live readings of one IMU and the wheels beside it.

    Feed readings as they arrive; samples come out in order, each once, as soon as their
    wheel reading is there or the bounded wait is over.
    """

    def __init__(
        self,
        setup: Setup,
        wait: float = DEFAULT_WAIT,
        keep: int = 0,
        loop_period: float = 0.0,
        checks: LiveChecks | None = None,
    ) -> None:
        """Start without a past.

        Args:
            setup: Robot, calibration and settings.
            wait: How much later [s] than a sample its wheel reading may be stamped.
            keep: How many of the latest raw samples `recent` holds.
            loop_period: Period [s] for which corrected samples are combined; 0 passes each on.
            checks: Gets every raw sample with its wheels, and each setup.
        """
        super().__init__(wait)
        self.counts: Counter[str] = Counter()
        """Samples in all, saturated ones, and ones that went without a wheel."""
        self.wheels_known = False
        """Whether the latest sample had a wheel reading."""
        self.recent: deque[Sample] = deque(maxlen=keep)
        """The latest raw samples, for a calibration."""
        self._corrector = Corrector(setup)
        self._oversampler = Oversampler(loop_period)
        self.temperature: float | None = None
        """The IMU's temperature [degC], where it comes."""
        self._started = self._restarted = False
        self._checks = checks
        self.configure(setup)

    def use(self, code: StepCode | None) -> None:
        """Correct by machine code from the next sample on; the numbers stay the same."""
        self._corrector.use(code)

    def configure(self, setup: Setup) -> None:
        """Use another setup from the next sample on; the past stays."""
        self._setup = setup
        self._corrector.reconfigure(self._warm(setup))
        if self._checks is not None:
            self._checks.configure(setup)

    def add_temperature(self, temperature: float) -> None:
        """Take the IMU's temperature [degC]; one that no chip survives is left out."""
        if not COLDEST < temperature < HOTTEST:
            self.counts["bad_temperatures"] += 1
            return
        self.temperature = temperature
        if any(self._setup.calibration.gyro_bias_slope):
            self._corrector.reconfigure(self._warm(self._setup))

    def _warm(self, setup: Setup) -> Setup:
        """Return the setup at the temperature that came last."""
        if self.temperature is None:
            return setup
        return replace(setup, calibration=at_temperature(setup.calibration, self.temperature))

    def add_imu(self, stamp: int, values: tuple[float, ...]) -> StampedSamples:
        """Take gyro x, y, z [rad/s] and accelerometer x, y, z [m/s^2]; return what is ready."""
        verdict = self._judged(stamp, values)
        if verdict is Verdict.SKIP:
            return []
        ready: StampedSamples = []
        if verdict is Verdict.RESTART:
            ready = self.flush()
            self._restart(stamp)
        return ready + self._completed(self._pairer.add_imu(stamp, values))

    def reset(self) -> None:
        """Forget everything but the counts."""
        self._pairer.reset()
        self._oversampler.reset()
        self._corrector.reset()
        self.recent.clear()
        self._restarted = self._started

    def begin_afresh(self) -> None:
        """Forget everything but the counts; the filters must be reset, too."""
        self.reset()
        self._restarted = True

    def _restart(self, stamp: int) -> None:
        self._pairer.restart(stamp)
        self._corrector.reset()
        self.recent.clear()
        self._restarted = True

    def _completed(self, paired: list[tuple[int, Sample]]) -> StampedSamples:
        ready: StampedSamples = []
        for stamp, sample in paired:
            combined = self._oversampler.add(self._correct(stamp, sample))
            if combined is not None:
                ready.append((stamp, combined))
        return ready

    def _correct(self, stamp: int, sample: Sample) -> CorrectedSample:
        if self._checks is not None:
            self._checks.add(stamp, sample)
        if self._restarted:
            self._restarted = False
            sample = sample._replace(dt=UNKNOWN_TIME)
        self._started = True
        self.wheels_known = sample.wheel_count > 0.0
        counts = self.counts
        counts["samples"] += 1
        if not self.wheels_known:
            counts["without_wheels"] += 1
        self.recent.append(sample)
        corrected = self._corrector.step(sample)
        if is_saturated(corrected):
            counts["saturated"] += 1
        return corrected
