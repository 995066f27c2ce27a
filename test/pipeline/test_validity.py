"""By its own deviation a tilt is valid later than it stays so."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from twbr_estimation.pipeline.validity import (
    EARNED_STDDEV,
    EARNED_TIME,
    LYING_STDDEV,
    PROVEN_STDDEV,
    PROVEN_TIME,
    REGAINED_STDDEV,
    SUSTAINED_SHARE,
    SUSTAINED_STDDEV,
    SUSTAINED_TIME,
    VALID_STDDEV,
    begin,
    certain,
    watch,
)
from twbr_estimation.samples import LYING, STANDARD_GRAVITY, CorrectedSample, TiltEstimate

DT = 0.01
SMALL, BETWEEN, LARGE = 0.5 * REGAINED_STDDEV, 0.5 * (EARNED_STDDEV + VALID_STDDEV), 0.25
SHORT, LONG = 0.5 * EARNED_TIME, 2.0 * EARNED_TIME
PUSH = SUSTAINED_TIME - 2.0 * DT


def verdicts(
    phases: list[tuple[float, float]],
    valid_stddev: float = VALID_STDDEV,
    tilt: float = 0.0,
    self_judged: bool = False,
) -> Iterator[bool]:
    """Yield the verdict at the end of each phase: a stated deviation [rad] and its duration [s]."""
    now, rest = None, dict.fromkeys(CorrectedSample._fields, 0.0)
    sample = CorrectedSample(**{**rest, "dt": DT, "accel_z": STANDARD_GRAVITY})
    for stddev, duration in phases:
        estimate = TiltEstimate(tilt, 0.0, 0.0, stddev * stddev)
        for _ in range(round(duration / DT)):
            if now is None:
                now = begin(sample, estimate, False, valid_stddev, self_judged)
            else:
                now = watch(now, sample, estimate, valid_stddev, self_judged)
        assert now is not None
        yield certain(now)


@pytest.mark.parametrize(
    ("phases", "expected"),
    [
        ([(BETWEEN, LONG)], [False]),  # a young estimate that says so itself
        ([(SMALL, DT)], [True]),
        ([(0.0, DT)], [True]),  # a filter that states none
        ([(BETWEEN, LONG), (SMALL, DT)], [False, True]),
        ([(SMALL, SHORT), (BETWEEN, DT)], [True, False]),  # it was a lie that was found out
        ([(SMALL, SHORT), (0.1, DT)], [True, True]),  # pushed soon after the start
        ([(SMALL, LONG), (LARGE, DT), (SMALL, SHORT), (0.1, DT)], [True, False, True, False]),
        ([(SMALL, LONG), (LARGE, DT), (SMALL, LONG), (0.1, PUSH)], [True, False, True, True]),
        ([(SMALL, LONG), (BETWEEN, PUSH)], [True, True]),  # no reason to stop the motors
        ([(SMALL, LONG), (BETWEEN, SHORT)], [True, False]),  # no push, but what is not known
        ([(SMALL, LONG), (BETWEEN, PUSH), (SMALL, DT), (BETWEEN, PUSH)], [True] * 4),
        ([(SMALL, LONG), (0.9 * SUSTAINED_STDDEV, LONG)], [True, True]),
        ([(SMALL, LONG), (BETWEEN, SHORT), (0.9 * SUSTAINED_STDDEV, DT)], [True, False, False]),
        ([(SMALL, LONG), (LARGE, DT)], [True, False]),
        ([(SMALL, LONG), (LARGE, DT), (BETWEEN, LONG), (SMALL, DT)], [True, False, False, True]),
    ],
)
def test_a_deviation_is_earned_small_and_lost_large(
    phases: list[tuple[float, float]], expected: list[bool]
) -> None:
    assert list(verdicts(phases)) == expected


PROVEN, UNPROVEN = 0.9 * PROVEN_STDDEV, 0.5 * (PROVEN_STDDEV + REGAINED_STDDEV)


@pytest.mark.parametrize(
    ("phases", "expected"),
    [
        ([(UNPROVEN, DT)], [True]),  # the first trust needs no proof
        ([(UNPROVEN, SHORT), (BETWEEN, DT), (UNPROVEN, SHORT)], [True, False, False]),
        ([(UNPROVEN, SHORT), (BETWEEN, DT), (PROVEN, DT)], [True, False, True]),
        ([(UNPROVEN, SHORT), (BETWEEN, DT), (UNPROVEN, PROVEN_TIME + DT)], [True, False, True]),
        ([(UNPROVEN, LONG), (LARGE, DT), (UNPROVEN, DT)], [True, False, True]),  # it was earned
    ],
)
def test_who_was_misled_at_the_start_has_to_prove_the_tilt(
    phases: list[tuple[float, float]], expected: list[bool]
) -> None:
    assert list(verdicts(phases, self_judged=True)) == expected


def test_a_users_smaller_limit_holds_for_both() -> None:
    limit = 0.5 * SMALL
    assert list(verdicts([(0.9 * limit, LONG), (1.1 * limit, DT)], limit)) == [True, False]
    assert list(verdicts([(1.1 * limit, DT)], limit)) == [False]  # from the first sample on


def test_a_users_larger_limit_allows_a_larger_deviation_for_long() -> None:
    lasting = SUSTAINED_SHARE * 2.0 * VALID_STDDEV
    phases = [(SMALL, LONG), (0.9 * lasting, LONG), (1.1 * lasting, LONG)]
    assert list(verdicts(phases, 2.0 * VALID_STDDEV)) == [True, True, False]
    assert list(verdicts(phases)) == [True, False, False]


@pytest.mark.parametrize("tilt", [LYING + 0.01, -LYING - 0.01, 3.1])
def test_the_tilt_of_a_robot_that_lies_must_be_better_known(tilt: float) -> None:
    little, more = 0.9 * LYING_STDDEV, 1.1 * LYING_STDDEV
    assert list(verdicts([(little, LONG), (more, DT), (little, DT)], tilt=tilt)) == [
        True,
        False,
        True,
    ]
    assert list(verdicts([(little, LONG), (more, DT)], tilt=0.9 * LYING)) == [True, True]


def test_a_lie_at_the_start_has_to_be_made_good_by_a_robot_that_lies_too() -> None:
    phases = [(PROVEN, SHORT), (BETWEEN, DT), (0.9 * LYING_STDDEV, SHORT), (PROVEN, DT)]
    found = list(verdicts(phases, tilt=LYING + 0.01, self_judged=True))
    assert found == [True, False, False, True]
