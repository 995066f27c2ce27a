"""A live evaluation gives the figures of the offline one."""

from __future__ import annotations

import itertools
import math
from dataclasses import asdict

import numpy as np
import pytest

from twbr_estimation.recording import TiltTrack
from twbr_estimation.scoring.live import LiveEvaluation
from twbr_estimation.scoring.score import Association, Score, ScoringOptions, score

SECOND = 1_000_000_000


def tracks(seed: int) -> dict[str, TiltTrack]:
    """Return a reference with a gap, and two estimates at other stamps, one late and biased."""
    random = np.random.default_rng(seed)
    times = {
        "reference": np.delete(np.arange(0.0, 30.0, 0.0031), slice(3000, 3100)),
        "late": np.sort(random.uniform(-0.5, 30.4, 6000)),
        "noisy": np.arange(0.0, 30.0, 0.01),
    }
    tilt = {name: 0.4 * np.sin(2.0 * t) + 0.1 * np.sin(9.0 * t) for name, t in times.items()}
    tilt["late"] = 0.4 * np.sin(2.0 * (times["late"] - 0.02)) + 0.01
    tilt["noisy"] = tilt["noisy"] + random.normal(0.0, 0.02, tilt["noisy"].size)
    return {
        name: TiltTrack((t * 1e9).astype(np.int64) + 9 * SECOND, tilt[name])
        for name, t in times.items()
    }


def feed(evaluation: LiveEvaluation, given: dict[str, TiltTrack], lag: dict[str, float]) -> None:
    """Deliver all values in the order of stamp plus lag [s] of their source; update often."""
    events = [
        (int(stamp) + round(lag[name] * SECOND), name, int(stamp), float(tilt))
        for name, track in given.items()
        for stamp, tilt in zip(track.stamps, track.tilt, strict=True)
    ]
    for count, (_, name, stamp, tilt) in zip(itertools.count(1), sorted(events), strict=False):
        if name == "reference":
            evaluation.add_reference(stamp, tilt)
        else:
            evaluation.add_estimate(name, stamp, tilt)
        if count % 700 == 0:
            evaluation.update()


def assert_same(live: Score, offline: Score) -> None:
    for figure, value in asdict(offline).items():
        assert getattr(live, figure) == pytest.approx(value, rel=1e-9, abs=1e-9), figure


@pytest.mark.parametrize("lag", [0.0, 0.3])
@pytest.mark.parametrize(
    "options",
    [ScoringOptions(), ScoringOptions(reference_delay=0.02, reference_offset=0.1, skip=2.0)],
)
def test_live_figures_equal_offline_figures(lag: float, options: ScoringOptions) -> None:
    given = tracks(seed=4)
    evaluation = LiveEvaluation(options)
    feed(evaluation, given, {"reference": lag, "late": 0.0, "noisy": 0.01})
    result = evaluation.result()
    association = Association(given["reference"], options)
    first = int(given["late"].stamps[0]) + round(options.skip * SECOND)
    for name in ("late", "noisy"):
        track = given[name]
        assert_same(result.estimators[name], score(track.stamps, track.tilt, association, first))
    assert result.estimators["late"].left_out > 0


def test_an_estimate_waits_for_the_reference() -> None:
    evaluation = LiveEvaluation()
    evaluation.add_reference(0, 0.0)
    evaluation.add_reference(10_000_000, 0.1)
    evaluation.add_estimate("one", 5_000_000, 0.05)
    evaluation.add_estimate("one", 15_000_000, 0.16)
    evaluation.update()
    assert evaluation.scores()["one"].samples == 1
    evaluation.add_reference(20_000_000, 0.2)
    evaluation.update()
    assert evaluation.scores()["one"].samples == 2
    assert evaluation.scores()["one"].max_abs_deg == pytest.approx(math.degrees(0.01))


def test_values_that_cannot_be_used_are_counted() -> None:
    evaluation = LiveEvaluation()
    for stamp, tilt in ((1, 0.0), (1, 0.0), (2, math.nan), (3, 0.0)):
        evaluation.add_estimate("one", stamp, tilt)
        evaluation.add_reference(stamp, tilt)
    evaluation.update()
    assert evaluation.refused == {"one": 2, "reference": 2}
    assert evaluation.scores()["one"].samples == 2


def test_a_looped_recording_ends_with_the_jump_of_the_reference() -> None:
    evaluation = LiveEvaluation()
    for stamp in (0, 3 * SECOND):
        evaluation.add_reference(stamp, 0.0)
    assert not evaluation.ends_before(2 * SECOND + 1)
    assert evaluation.ends_before(SECOND)


def test_an_estimator_that_jumps_back_first_keeps_what_was_compared() -> None:
    evaluation = LiveEvaluation()
    for stamp in range(10 * SECOND, 13 * SECOND, SECOND // 100):
        evaluation.add_estimate("one", stamp, 0.02)
        evaluation.add_reference(stamp, 0.0)
    evaluation.add_estimate("one", SECOND, 0.0)
    evaluation.update()
    assert evaluation.scores()["one"].samples == 300


def test_memory_is_bounded_while_the_figures_go_on() -> None:
    evaluation = LiveEvaluation()
    count = 20_000
    for index in range(count):
        evaluation.add_reference(index * SECOND // 100, 0.0)
        evaluation.add_estimate("one", index * SECOND // 100, 0.01)
        if index % 1000 == 0:
            evaluation.update()
    evaluation.update()
    (estimator,) = evaluation._estimators.values()
    assert estimator.values.stamps.size <= 6001
    assert evaluation.scores()["one"].samples == count


def test_values_that_were_lost_on_the_way_leave_a_mark() -> None:
    evaluation = LiveEvaluation()
    for index in range(1000):
        stamp = 10**12 + index * 2_000_000 + (index % 3) * 100_000
        evaluation.add_reference(stamp, 0.1)
        if not 400 <= index < 437 and index != 700:
            evaluation.add_estimate("kalman", stamp, 0.1)
        if index % 250 == 249:
            evaluation.update()
    assert evaluation.result().repairs == {"kalman: values missing between its stamps": 38}
