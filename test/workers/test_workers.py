"""Units of work in this process and in several of this machine."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from twbr_estimation.workers import ThisProcess, Work, Workers
from twbr_estimation.workers.local_pool import ATTEMPTS, LocalPool
from workers.work import dies, refuses, slow, squared


@pytest.mark.parametrize("workers", [ThisProcess(), LocalPool(2)], ids=["here", "pool"])
def test_every_unit_has_its_result_and_its_message(workers: Workers) -> None:
    messages: list[str] = []
    outcomes = list(workers.run(Work(squared, 1), range(20), messages.append))
    assert sorted((each.unit, each.result) for each in outcomes) == [
        (number, number * number + 1) for number in range(20)
    ]
    assert sorted(messages) == sorted(f"at {number}" for number in range(20))


@pytest.mark.parametrize("workers", [ThisProcess(), LocalPool(2)], ids=["here", "pool"])
def test_units_are_taken_as_workers_become_free(workers: Workers) -> None:
    taken: list[int] = []

    def units() -> Iterator[int]:
        for number in range(1000):
            taken.append(number)
            yield number

    with closing(workers.run(Work(squared, 0), units(), lambda message: None)) as outcomes:
        next(outcomes)
    assert len(taken) < 20


@pytest.mark.parametrize("workers", [ThisProcess(), LocalPool(2)], ids=["here", "pool"])
def test_what_a_unit_raises_is_raised(workers: Workers) -> None:
    with pytest.raises(ValueError, match="unit 3"):
        list(workers.run(Work(refuses, None), [3], lambda message: None))


def test_a_process_that_dies_costs_no_result(tmp_path: Path) -> None:
    units = [(number, 1 if number == 2 else 0) for number in range(8)]
    outcomes = list(LocalPool(2).run(Work(dies, tmp_path), units, lambda message: None))
    assert sorted(each.result for each in outcomes) == list(range(8))
    assert not any(each.lost for each in outcomes)
    assert len((tmp_path / "2").read_text()) == 2, "it was done once more"


def test_a_unit_that_always_kills_its_process_is_lost_and_no_other(tmp_path: Path) -> None:
    units = [(number, 100 if number == 2 else 0) for number in range(8)]
    outcomes = list(LocalPool(2).run(Work(dies, tmp_path), units, lambda message: None))
    (lost,) = [each for each in outcomes if each.lost]
    assert lost.unit == (2, 100)
    assert f"died {ATTEMPTS} times" in lost.lost
    assert sorted(each.result for each in outcomes if not each.lost) == [0, 1, 3, 4, 5, 6, 7]
    assert len((tmp_path / "2").read_text()) == ATTEMPTS


def test_what_is_given_up_stops(tmp_path: Path) -> None:
    (tmp_path / "go").touch()
    with closing(LocalPool(1).run(Work(slow, tmp_path), range(9), lambda message: None)) as found:
        next(found)
        (tmp_path / "go").unlink()
        begun = time.monotonic()
    processes = {int(path.suffix[1:]) for path in tmp_path.iterdir()}
    assert time.monotonic() - begun < 30.0
    assert not any(map(alive, processes))


def alive(process: int) -> Any:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True
