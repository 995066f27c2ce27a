"""A job on many recordings: cut, repeated, with failures, on a pool whose workers die."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from many.jobs import Deadly
from twbr_estimation.cli.many import describe
from twbr_estimation.drives.request import RunRequest
from twbr_estimation.many.evaluation import Evaluation, merged
from twbr_estimation.many.places import recordings_at
from twbr_estimation.many.results import ResultTable
from twbr_estimation.many.series import BATCH_SECONDS, Progress, Series, run
from twbr_estimation.workers import ThisProcess, Work, Workers
from twbr_estimation.workers.local_pool import LocalPool

NAMES = ("complementary", "kalman", "accelerometer")
REQUEST = RunRequest(NAMES)


@pytest.fixture
def table(tmp_path: Path) -> ResultTable:
    return ResultTable(tmp_path / "results.jsonl")


@dataclass
class Counted:
    """Workers whose units are counted; after some of them Ctrl-C is pressed."""

    workers: Workers
    stop_after: int = 10**9
    units: int = 0
    parts: int = 0

    def run(self, work: Work, units: Any, report: Any) -> Iterator[Any]:
        for outcome in self.workers.run(work, units, report):
            self.units += 1
            self.parts += sum(len(share.parts) for share in outcome.unit.shares)
            yield outcome
            if self.units >= self.stop_after:
                raise KeyboardInterrupt


def scores(series: Series) -> list[Any]:
    return [
        merged(place, NAMES, series.results(number)) for number, place in enumerate(series.places)
    ]


def test_the_scores_are_those_of_one_recording_at_a_time(runs: Path, table: ResultTable) -> None:
    places = [place for place in recordings_at([runs]) if "damaged" not in place]
    request = replace(REQUEST, preset="table2", values={"kalman": {"r": 0.2}})
    done = run(Evaluation.of(request), places, ThisProcess(), table)
    for place, score in zip(places, scores(done), strict=True):
        alone = request.runs(Path(place), reference=True).scores()
        assert score.estimators == alone.estimators
        assert list(score.warnings) == list(alone.warnings)
        assert replace(score, warnings=(), repairs={}) == replace(alone, warnings=(), repairs={})
    assert done.failures() == []


def test_a_pool_finds_the_same_bits_and_a_failed_recording_is_a_row(
    runs: Path, table: ResultTable, tmp_path: Path
) -> None:
    places = [*recordings_at([runs]), str(runs / "nowhere")]
    here = run(Evaluation.of(REQUEST), places, ThisProcess(), table)
    other = ResultTable(tmp_path / "pool.jsonl")
    pool = run(Evaluation.of(REQUEST), places, LocalPool(2), other)
    assert scores(here) == scores(pool)
    for done in (here, pool):
        damaged, nowhere = done.failures()
        assert damaged.place.endswith("damaged.mcap") and "damaged.mcap" in str(damaged)
        assert str(nowhere) == f"{runs / 'nowhere'}: there is no such recording"
    lines = (tmp_path / "pool.jsonl").read_text().splitlines()
    assert sum('"error":null' not in line for line in lines) == 2


def test_what_is_repeated_computes_nothing_and_what_is_new_only_itself(
    runs: Path, table: ResultTable
) -> None:
    places = recordings_at([runs])
    first, again, more = Counted(ThisProcess()), Counted(ThisProcess()), Counted(ThisProcess())
    begun = run(Evaluation.of(REQUEST), places, first, table)
    distinct = len(places) - 2  # a copy, and a damaged one, which fails in one part
    assert first.parts == distinct * 4 + 4
    repeated = run(Evaluation.of(REQUEST), places, again, table)
    assert again.parts == 0
    assert scores(repeated) == scores(begun) and repeated.failures() == begun.failures()
    wider = replace(REQUEST, names=(*NAMES, "gyro"))
    run(Evaluation.of(wider), places, more, table)
    assert more.parts == distinct
    changed = replace(REQUEST, values={"kalman": {"r": 0.3}})
    other = Counted(ThisProcess())
    run(Evaluation.of(changed), places, other, table)
    assert other.parts == distinct


def test_a_run_that_is_cut_goes_on(
    runs: Path, table: ResultTable, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("twbr_estimation.many.series.BATCH_SECONDS", 0.0)
    places = recordings_at([runs])
    cut, rest = Counted(ThisProcess(), stop_after=5), Counted(ThisProcess())
    with pytest.raises(KeyboardInterrupt):
        run(Evaluation.of(REQUEST), places, cut, table)
    assert cut.parts == 5, "with no time for a batch, each part is one"
    done = run(Evaluation.of(REQUEST), places, rest, table)
    kept = cut.parts
    assert rest.parts == 3 * 4 + 4 - kept
    assert sum(score is not None for score in scores(done)) == 4


def test_a_worker_that_dies_costs_no_result(runs: Path, table: ResultTable, tmp_path: Path) -> None:
    places = recordings_at([runs / "day0" / "run*", runs / "day1" / "run*"])
    job = Deadly(tmp_path / "died", {places[1]: 4, places[2]: 100})
    done = run(job, places, LocalPool(2), table)
    results = [done.results(number) for number in range(3)]
    assert results[0] == {"": {"samples": 300}} and results[1] == results[0]
    (failure,) = done.failures()
    assert failure.place == places[2] and "died 3 times" in failure.reason
    again = Counted(ThisProcess())
    assert run(Deadly(tmp_path / "died", {}), places, again, table).failures() == []
    assert again.parts == 1, "what killed its worker is tried again"


def test_batches_hold_about_a_second(runs: Path, table: ResultTable) -> None:
    places = recordings_at([runs / "day0" / "run0", runs / "day0" / "run2", runs / "day1" / "run1"])

    def shares(rate: float) -> list[list[int]]:
        series = Series(Evaluation.of(REQUEST), places, table, lambda progress: None)
        series._rate = rate
        batches = series.batches(lambda: None)
        return [[len(share.parts) for share in batch.shares] for batch in batches]

    size = sum(path.stat().st_size for path in (runs / "day0" / "run0").rglob("*.mcap"))
    assert shares(1e-12) == [[4, 4, 4]], "short ones together"
    a_part = BATCH_SECONDS / (2.2 * size)
    assert shares(a_part)[:2] == [[2], [2]], "a long one in parts"


def test_progress_has_a_rate_and_the_time_that_is_left(runs: Path, table: ResultTable) -> None:
    seen: list[Progress] = []
    places = recordings_at([runs])
    run(Evaluation.of(REQUEST), places, ThisProcess(), table, seen.append)
    last = seen[-1]
    assert (last.done, last.recordings, last.failed) == (5, 5, 1)
    assert last.remaining == 0.0
    half = Progress(200, 60, 10, 0, 0, 1, elapsed=25.0)
    assert half.rate == 2.0 and half.remaining == 70.0
    assert describe(half) == "60 of 200 recordings, 1 failed, 2 a second, 0:01:10 left"
