"""Workers that remember: what is known is not done again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from twbr_estimation.many.remembering import Remembering
from twbr_estimation.many.results import ResultTable
from twbr_estimation.simulation import simulate
from twbr_estimation.tuning.filter import TunedFilter, TuningTask
from twbr_estimation.tuning.objective import prepare
from twbr_estimation.tuning.several import tune_filters
from twbr_estimation.workers import ThisProcess, Work

NAMES = ["complementary", "kalman_tuned"]


class Counted:
    """Workers that count what they are asked for; Ctrl-C comes after the first unit."""

    def __init__(self, cut: bool = False) -> None:
        self.cut, self.units = cut, list[str]()

    def run(self, work: Work, units: Any, report: Any) -> Iterator[Any]:
        for outcome in ThisProcess().run(work, units, report):
            self.units.append(outcome.unit)
            yield outcome
            if self.cut:
                raise KeyboardInterrupt


def task(seed: int) -> TuningTask:
    return TuningTask((prepare(simulate("paper", 0.01, 5.0, seed).drive),))


def ignored(name: str, figure: float, values: Mapping[str, float]) -> None:
    pass


@pytest.fixture
def table(tmp_path: Path) -> ResultTable:
    return ResultTable(tmp_path / "results.jsonl")


def test_tuning_that_is_cut_goes_on_and_that_is_repeated_computes_nothing(
    table: ResultTable,
) -> None:
    def tuned(workers: Any, seed: int = 31) -> list[TunedFilter]:
        remembering = Remembering(workers, table, "tune", asdict, TunedFilter.of)
        return tune_filters(task(seed), NAMES, remembering, ignored)

    cut, rest, again, other = Counted(cut=True), Counted(), Counted(), Counted()
    tuned(cut)
    found = tuned(rest)
    assert sorted(cut.units + rest.units) == sorted(NAMES), "each is done once"
    assert tuned(again) == found and again.units == []
    assert found == tune_filters(task(31), NAMES, ThisProcess(), ignored), "to the last bit"
    tuned(other, seed=32)
    assert sorted(other.units) == sorted(NAMES), "another recording is other work"
