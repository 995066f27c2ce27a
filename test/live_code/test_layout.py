"""Records as rows of doubles: what is written comes back, for every filter and the correction."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

from twbr_estimation.filters.base import filters
from twbr_estimation.live_code.checking import corrected_samples, raw_samples
from twbr_estimation.live_code.layout import Layout, LayoutError, form_of, numbers_of
from twbr_estimation.live_code.steps import (
    correction_layouts,
    correction_step,
    filter_layouts,
    filter_step,
)
from twbr_estimation.pipeline.correction import Corrector
from twbr_estimation.pipeline.watched_filter import SELF_JUDGED, WatchedFilter
from twbr_estimation.robot import Setup


class Inner(NamedTuple):
    flag: bool
    pair: tuple[float, int]


class Outer(NamedTuple):
    first: float
    inner: Inner
    matrix: Any


def test_what_is_written_comes_back() -> None:
    record = Outer(1.5, Inner(True, (2.5, 7)), np.arange(6.0).reshape(2, 3))
    layout = Layout(record)
    row = np.full(layout.size, np.nan)
    layout.writer()(record, row)
    assert row.tolist() == [1.5, 1.0, 2.5, 7.0, *range(6)] == numbers_of(record)
    back = layout.plain_reader()(row)
    assert type(back) is Outer and back[:2] == record[:2]
    assert (type(back.inner.flag), type(back.inner.pair[1])) == (bool, int)
    np.testing.assert_array_equal(back.matrix, record.matrix)
    row[:] = 0.0
    assert back.matrix[1, 2] == 5.0  # a copy: the row is overwritten by the next step


def test_records_of_one_form_have_one_layout_and_others_another() -> None:
    usual = Outer(1.5, Inner(True, (2.5, 7)), np.zeros((2, 3)))
    assert form_of(usual) == form_of(Outer(0.0, Inner(False, (0.0, 1)), np.ones((2, 3))))
    others = (
        usual._replace(first=1),
        usual._replace(first=True),
        usual._replace(inner=(True, (2.5, 7))),
        usual._replace(inner=Inner(True, (2.5, 7.0))),
        usual._replace(matrix=np.zeros((3, 2))),
        usual._replace(matrix=np.zeros((2, 3), np.float32)),
    )
    assert len({form_of(each) for each in (usual, *others)}) == 7


@pytest.mark.parametrize("foreign", ["text", None, np.arange(3)])
def test_other_things_have_no_place(foreign: object) -> None:
    with pytest.raises(LayoutError, match="no number"):
        Layout((1.0, foreign))


@pytest.mark.parametrize("name", sorted(filters()))
def test_the_step_on_rows_is_the_step_of_the_live_path(name: str) -> None:
    entry, self_judged = filters()[name], name in SELF_JUDGED
    layouts, step = filter_layouts(entry), filter_step(entry, self_judged)
    sample, coefficients, state, results = (np.zeros(each.size) for each in layouts)
    watched = WatchedFilter(entry)
    samples = corrected_samples()
    watched.step(next(samples))
    coefficients[:] = numbers_of((watched._coefficients, watched.valid_stddev))
    state[:] = numbers_of((watched.state, watched._watch))
    for _ in range(60):
        reading = next(samples)
        sample[:] = reading
        step(sample, coefficients, state, results)
        expected = watched.step(reading)
        assert tuple(results[:4]) == expected
        assert state.tolist() == list(numbers_of((watched.state, watched._watch)))


def test_the_correction_on_rows_is_the_correction() -> None:
    layouts, step = correction_layouts(), correction_step()
    sample, coefficients, state, results = (np.zeros(each.size) for each in layouts)
    corrector, samples = Corrector(Setup()), raw_samples()
    corrector.step(next(samples))
    coefficients[:], state[:] = numbers_of(corrector._coefficients), numbers_of(corrector._state)
    for _ in range(200):
        reading = next(samples)
        sample[:] = reading
        step(sample, coefficients, state, results)
        assert tuple(results) == corrector.step(reading)


def test_two_records_of_one_name_are_kept_apart() -> None:
    class State(NamedTuple):
        tilt: float

    inner = State

    def outer() -> type[Any]:
        class State(NamedTuple):
            kept: inner
            rate: float

        return State

    record = outer()(inner(0.1), 0.2)
    assert Layout(record).reader()([0.1, 0.2]) == record
