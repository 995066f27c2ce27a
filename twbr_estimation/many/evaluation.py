"""`evaluate` on many recordings: a part is one filter, and its result a score."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from ..checks.finding import noteworthy
from ..checks.table import as_json, from_json
from ..configuration.filter_settings import Settings
from ..drives import Drive, Runs
from ..drives.drive import chosen
from ..drives.request import RunRequest
from ..errors import ConfigurationError
from ..filters import filter_named
from ..scoring.score import SMOOTHED, RecordingScore, Score, finite_only, score_recording
from ..smoothing import SMOOTHER, SmoothedTrack
from .digests import digest_of_folder
from .jobs import WHOLE, Job

Result = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Opened:
    """A recording, ready for one filter after the other."""

    drive: Drive
    compared: Drive
    """With the reference that estimates are compared with."""
    smoothed: SmoothedTrack | None


@dataclass(frozen=True, slots=True)
class Evaluation(Job):
    """Filters, settings and comparison; as a job."""

    request: RunRequest
    configured: str = field(default="")
    """Digest of the folder of configuration files."""
    verb: str = "evaluate"

    @staticmethod
    def of(request: RunRequest) -> Evaluation:
        """Return the job of a request.

        Raises:
            ConfigurationError: an estimator has the name of a filter that runs.
        """
        for name in request.estimators:
            if name in request.names:
                raise ConfigurationError(f"estimator {name}: this is a filter's name; take another")
        return Evaluation(request, digest_of_folder(request.config))

    @property
    def parts(self) -> tuple[str, ...]:
        """The recording itself, with estimators that it holds, and the filters."""
        return (WHOLE, *self.request.names)

    def settings(self, part: str) -> str:
        """Return what shapes the score of a filter, or what the recording itself gives."""
        asked = self.request
        relevant = (part, SMOOTHER) if asked.smooth else (part,)
        values = [(name, sorted(asked.values.get(name, {}).items())) for name in relevant]
        shared = (asked.preset, asked.terms, asked.topics, asked.options)
        rest = (asked.loop_period, asked.smooth, self.configured)
        estimators = sorted(asked.estimators.items()) if part == WHOLE else []
        return repr((values, *shared, *rest, estimators))

    def open(self, place: str, path: Path) -> Opened:
        """Read a recording.

        Raises:
            TwbrError: it cannot be used.
        """
        drive = self.request.drive(path, reference=True)
        drive = replace(drive, recording=replace(drive.recording, source=place))
        drive.values_of(chosen(self.request.names), self.request.values)
        smoothed = drive.smoothed(self.request.values) if self.request.smooth else None
        runs = Runs(drive, (), {}, {}, smoothed)
        bare = replace(runs.compared, recording=replace(runs.recording, estimators={}))
        return Opened(drive, bare, smoothed)

    def run(self, opened: Opened, part: str) -> Result:
        """Run one filter and score it, or say what there is to say about the recording.

        Raises:
            TwbrError: estimate and reference do not overlap, or a value is out of bounds.
        """
        if part == WHOLE:
            return _facts(opened)
        drive = opened.compared
        values = {name: each for name, each in self.request.values.items() if name == part}
        runs = drive.run(part, values=values)
        parameters = filter_named(part).configure(runs.parameters[part])
        found: dict[str, Any] = {
            "parameters": parameters._asdict(),
            "warnings": list(filter_named(part).warnings(parameters, drive.dt)),
        }
        kept, diverges = finite_only(runs.tracks, int(drive.recording.imu.stamps[0]))
        if not kept:
            return {**found, "score": None, "diverges": diverges[0]}
        score = score_recording(drive.recording, kept, drive.options, (), drive.association)
        return {**found, "score": asdict(score.estimators[part])}


def _facts(opened: Opened) -> Result:
    """Return what a table says about a recording beside its filters."""
    drive, smoothed = opened.drive, opened.smoothed
    runs = Runs(drive, (), {}, {}, smoothed)
    others, diverges = finite_only(runs.tracks, int(drive.recording.imu.stamps[0]))
    compared = runs.compared
    scores = score_recording(runs.recording, others, compared.options, (), compared.association)
    return {
        "dt": drive.recording.dt,
        "samples": int(drive.recording.imu.stamps.size),
        "period": drive.dt,
        "repairs": dict(drive.recording.repairs),
        "reference": SMOOTHED if drive.recording.reference is None else "encoder",
        "smoothed_deviation_deg": None if smoothed is None else math.degrees(smoothed.deviation),
        "estimators": {name: asdict(score) for name, score in scores.estimators.items()},
        "tuned": {
            "dt": drive.settings.dt,
            "source": drive.settings.source,
            "filters": sorted(drive.settings.values),
        },
        "findings": as_json(noteworthy(drive.findings)),
        "notes": list(drive.notes),
        "diverges": diverges,
    }


def merged(
    source: str, names: tuple[str, ...], results: Mapping[str, Result]
) -> RecordingScore | None:
    """Return the scores of one recording as `Runs.scores` has them; None where there are none.

    Args:
        source: the recording.
        names: the filters, in their order.
        results: by part.
    """
    facts = results.get(WHOLE)
    done = {name: results[name] for name in names if name in results}
    scores = {name: Score(**each["score"]) for name, each in done.items() if each["score"]}
    if facts is None or not (scores or facts["estimators"]):
        return None
    scores.update((name, Score(**each)) for name, each in facts["estimators"].items())
    tuned = facts["tuned"]
    values: dict[str, dict[str, float]] = {name: {} for name in tuned["filters"]}
    settings = Settings(values, dt=tuned["dt"], source=tuned["source"])
    return RecordingScore(
        source=source,
        dt=facts["dt"],
        samples=facts["samples"],
        estimators=scores,
        repairs=facts["repairs"],
        warnings=[
            *settings.warnings(facts["period"], map(filter_named, names)),
            *(text for each in done.values() for text in each["warnings"]),
            *(each.sentence for each in from_json(facts["findings"])),
            *facts["notes"],
            *(each["diverges"] for each in done.values() if not each["score"]),
            *facts["diverges"],
        ],
        findings=facts["findings"],
        reference=facts["reference"],
        smoothed_deviation_deg=facts["smoothed_deviation_deg"],
    )
