"""A recording with its robot, paired and corrected once, when it is first needed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

from ..batch import CorrectedTrack, correct, oversampled, run_filters
from ..checks.check import check
from ..checks.finding import Finding, noteworthy
from ..configuration.filter_settings import Settings
from ..configuration.of_recording import with_terms
from ..errors import ConfigurationError, RecordingError
from ..filters import Filter, filter_named, filters, listed_filters
from ..parameters.argument_checks import (
    number_within,
    require_callable,
    require_kind,
    require_names,
    shown,
)
from ..pipeline.pairing import SampleTrack, pair
from ..pipeline.temperature import without_temperature_drift
from ..recording import Recording, TiltTrack
from ..robot import Calibration, CorrectionSettings, Setup
from ..samples import RESTART_GAP
from ..scoring.score import Association, ScoringOptions
from .runs import Runs

if TYPE_CHECKING:  # most runs smooth nothing
    from ..smoothing import Progress, SmoothedTrack

Values = Mapping[str, Mapping[str, float]]
"""Parameter values by filter name."""


@dataclass(frozen=True, eq=False)
class Drive:
    """One recording, ready for filters; made by `load` from a file, or by `simulate`."""

    recording: Recording
    setup: Setup = field(default_factory=Setup)
    """Robot, calibration and correction."""
    settings: Settings = field(default_factory=Settings)
    """Parameter values of the filters where they are not the defaults."""
    options: ScoringOptions = field(default_factory=ScoringOptions)
    """How estimates are compared with the reference."""
    loop_period: float = 0.0
    """Period [s] for which samples are combined before the filters; 0 takes each."""
    notes: tuple[str, ...] = ()
    """Remarks on where the settings come from."""

    def __post_init__(self) -> None:
        require_kind("recording", self.recording, Recording, "a Recording")
        self.recording.require_usable()
        require_kind("setup", self.setup, Setup, "a Setup")
        turned = self.recording.with_wheel_angles(self.setup.robot.wheel_radius)
        object.__setattr__(self, "recording", turned)
        require_kind("settings", self.settings, Settings, "Settings")
        require_kind("options", self.options, ScoringOptions, "ScoringOptions")
        object.__setattr__(self, "notes", require_names("notes", self.notes))
        object.__setattr__(self, "loop_period", require_period(self.loop_period))

    def __repr__(self) -> str:
        """Return a line about the recording."""
        return repr(self.recording).replace("Recording", "Drive", 1)

    @property
    def source(self) -> str:
        """Where the recording comes from."""
        return self.recording.source

    @property
    def dt(self) -> float:
        """Period of the samples that reach the filters [s]."""
        return max(self.loop_period, self.recording.dt)

    @cached_property
    def samples(self) -> SampleTrack:
        """The IMU samples with wheels and motors at the same instants."""
        recording = without_temperature_drift(self.recording, self.setup)
        return pair(recording.imu, recording.wheels, motors=recording.motors)

    @cached_property
    def corrected_samples(self) -> CorrectedTrack:
        """Every sample, corrected.

        Raises:
            ConfigurationError: a low-pass of the correction diverges at this sampling period.
        """
        _require_stable(self.setup.correction, self.recording.dt)
        return correct(self.samples, self.setup)

    @cached_property
    def corrected(self) -> CorrectedTrack:
        """Input of the filters: corrected samples, combined for the period of the loop."""
        if self.loop_period > 0.0:
            return oversampled(self.corrected_samples, self.loop_period)
        return self.corrected_samples

    @cached_property
    def association(self) -> Association | None:
        """The reference as `options` has it, at any stamps; None without one."""
        reference = self.recording.reference
        return None if reference is None else Association(reference, self.options)

    @cached_property
    def findings(self) -> tuple[Finding, ...]:
        """What the data show about themselves and the robot's description, PASS included."""
        return check(without_temperature_drift(self.recording, self.setup), self.setup)

    @property
    def doubts(self) -> tuple[str, ...]:
        """The findings that are worth a warning, as sentences, but saturation."""
        found = noteworthy(self.findings)
        return tuple(each.sentence for each in found if each.check != "saturation")

    @cached_property
    def key(self) -> str:
        """A digest of readings, reference and settings: equal for equal content, not by name."""
        digest = hashlib.sha256(repr((self.setup, self.settings.values, self.options)).encode())
        digest.update(repr(self.loop_period).encode())
        digest.update(self.samples.stamps.tobytes() + self.samples.columns.tobytes())
        if (reference := self.recording.reference) is not None:
            digest.update(reference.stamps.tobytes() + reference.tilt.tobytes())
        return digest.hexdigest()

    @cached_property
    def uncorrected(self) -> Drive:
        """The same readings taken as they are: no calibration, no motion removed."""
        setup = Setup(self.setup.robot, Calibration(), self.setup.correction)
        return self.with_setup(with_terms(setup, ()))

    def with_setup(self, setup: Setup) -> Drive:
        """Return the recording with another robot, calibration or correction; pairs stay.

        Raises:
            ConfigurationError: it is no `Setup`.
        """
        require_kind("setup", setup, Setup, "a Setup")
        if setup == self.setup:
            return self
        other = replace(self, setup=setup)
        if _warmth(setup) == _warmth(self.setup):
            other.__dict__["samples"] = self.samples
        return other

    def with_terms(self, *terms: str) -> Drive:
        """Return the recording corrected for exactly these motion terms.

        Raises:
            ConfigurationError: there is no such term.
        """
        return self.with_setup(with_terms(self.setup, terms))

    def with_reference(self, reference: TiltTrack) -> Drive:
        """Return the recording with another reference; what is corrected stays.

        Raises:
            ConfigurationError: it is no `TiltTrack`.
        """
        require_kind("reference", reference, TiltTrack, "a TiltTrack")
        other = replace(self, recording=replace(self.recording, reference=reference))
        other.__dict__.update(
            (name, value)
            for name, value in self.__dict__.items()
            if name in ("samples", "corrected_samples", "corrected")
        )
        return other

    def run(
        self,
        *names: str | Filter,
        values: Values | None = None,
        smooth: bool = False,
        progress: Progress = lambda share: None,
    ) -> Runs:
        """Run filters over the recording.

        Args:
            names: filters by name, or `Filter` objects of your own; all filters where empty.
            values: parameter values by filter name; they rule over the settings.
            smooth: whether to smooth the recording, too: a reference where it has none.
            progress: called with the share of the smoothing that is done, 0 to 1.

        Raises:
            ConfigurationError: an unknown filter or parameter, or a value out of bounds.
            RecordingError: fewer than two samples are to be smoothed.
        """
        require_kind("smooth", smooth, bool, "True or False")
        require_callable("progress", progress)
        entries = chosen(names)
        given = self.values_of(entries, {} if values is None else values)
        for name in self.recording.estimators:
            if name in given:
                raise ConfigurationError(f"estimator {name}: this is a filter's name; take another")
        ready = [(entry, entry.configure(given[entry.name])) for entry in entries]
        tracks = run_filters(ready, self.corrected, self.setup.robot)
        found = {entry.name: track for entry, track in zip(entries, tracks, strict=True)}
        smoothed = self.smoothed(values, progress) if smooth else None
        return Runs(self, tuple(entries), given, found, smoothed)

    def smoothed(
        self, values: Values | None = None, progress: Progress = lambda share: None
    ) -> SmoothedTrack:
        """Return the tilt that the whole recording gives with hindsight.

        Args:
            values: parameter values by filter name; those of `ins_odometer` count.
            progress: called with the share that is done, 0 to 1.

        Raises:
            ConfigurationError: an unknown parameter, or a value out of bounds.
            RecordingError: there are fewer than two samples.
        """
        require_callable("progress", progress)
        if self.recording.imu.stamps.size < 2:
            raise RecordingError(f"{self.source}: fewer than two samples cannot be smoothed")
        from ..smoothing import SMOOTHER, smooth

        own = {**self.settings.values.get(SMOOTHER, {}), **_mapping(values).get(SMOOTHER, {})}
        return smooth(self.corrected_samples, self.setup.robot, own, progress)

    def values_of(self, entries: Iterable[Filter], values: Values) -> dict[str, dict[str, float]]:
        """Return the values in force by filter: those of the settings, then `values`.

        Raises:
            ConfigurationError: it is no such mapping, or names a filter that does not run.
        """
        values = _mapping(values)
        found = {
            entry.name: {**self.settings.values.get(entry.name, {}), **values.get(entry.name, {})}
            for entry in entries
        }
        for name in values:
            if name not in found:
                known = filters().get(name)
                said = "has values but does not run; name it, too" if known else "is no filter"
                raise ConfigurationError(f"`values`: {name} {said}")
        return found


def _mapping(values: Values | None) -> Values:
    """Return parameter values by filter name.

    Raises:
        ConfigurationError: they are no such mapping.
    """
    given = {} if values is None else values
    wanted = "a mapping of parameters to numbers by filter name"
    require_kind("values", given, Mapping, wanted)
    for name, each in given.items():
        require_kind(f"values[{name!r}]", each, Mapping, "a mapping of parameters to numbers")
    return given


def require_period(loop_period: float) -> float:
    """Return a period for which samples are combined.

    Raises:
        ConfigurationError: it is no number, negative, or so long that filters would start afresh.
    """
    return number_within("loop_period", loop_period, 0.0, RESTART_GAP, "s")


def _warmth(setup: Setup) -> tuple[object, ...]:
    """Return what of a setup the paired samples depend on."""
    calibration = setup.calibration
    return calibration.gyro_bias_slope, calibration.gyro_bias_temperature


def chosen(names: Iterable[str | Filter]) -> list[Filter]:
    """Return the filters of these names or definitions, each once; all where there are none.

    Raises:
        ConfigurationError: there is no such filter, or two differ and have one name.
    """
    found: dict[str, Filter] = {}
    for each in names:
        if isinstance(each, str) and each == "all":
            found.update(listed_filters())
            continue
        if not isinstance(each, (str, Filter)):
            raise ConfigurationError(
                f"`names`: {shown(each)} is neither the name of a filter nor a Filter; "
                "give each as an argument of its own"
            )
        entry = filter_named(each) if isinstance(each, str) else each
        if found.setdefault(entry.name, entry) is not entry:
            raise ConfigurationError(f"`names`: two different filters have the name {entry.name}")
    return list(found.values()) or list(listed_filters().values())


def _require_stable(correction: CorrectionSettings, dt: float) -> None:
    """Raise where a low-pass of the correction diverges at this sampling period [s]."""
    for name in ("rate_time_constant", "velocity_time_constant"):
        value = getattr(correction, name)
        if value <= -0.5 * dt < 0.0:
            raise ConfigurationError(
                f"correction.{name}: {value:g} s is unstable at a sampling period of {dt:g} s; "
                f"it must be above {-0.5 * dt:g} s"
            )
