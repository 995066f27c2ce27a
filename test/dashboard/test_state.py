"""The state of a robot in words."""

from __future__ import annotations

import pytest

from twbr_estimation.dashboard.source import Status, StreamRate
from twbr_estimation.dashboard.state import SILENT_AFTER, losses, name_within, state_in_words

FILTER = Status("filter_node", "OK", "estimating", {"lost_samples": "0"}, 0.5)
BALANCING = Status("controller_node", "OK", "balancing with pid", {}, 0.5)


def test_a_robot_that_balances() -> None:
    assert state_in_words([FILTER, BALANCING], False, True) == ("balancing with pid", "OK")


def test_a_robot_without_controller_estimates() -> None:
    assert state_in_words([FILTER], False, None) == ("estimating", "OK")


def test_a_fallen_robot() -> None:
    fallen = Status("controller_node", "ERROR", "motors cut: fallen", {}, 0.5)
    assert state_in_words([fallen, FILTER], False, True) == ("motors cut: fallen", "ERROR")


def test_no_tilt_is_stale_whatever_was_said_last() -> None:
    words, level = state_in_words([FILTER, BALANCING], True, True)
    assert words.startswith("stale: no tilt arrives") and level == "STALE"
    assert "balancing" not in words


def test_a_node_that_has_fallen_silent_is_named_and_its_last_words_do_not_count() -> None:
    gone = Status("controller_node", "STALE", "silent for 9 s", {}, SILENT_AFTER + 6.0)
    words, level = state_in_words([FILTER, gone], False, True)
    assert words == "controller_node silent; estimating" and level == "WARN"


@pytest.mark.parametrize("level", ["OK", "WARN"])
def test_a_tilt_that_is_not_valid_is_an_error(level: str) -> None:
    doubt = Status("filter_node", level, "in doubt by 5 deg", {}, 0.5)
    words, shown = state_in_words([doubt, BALANCING], False, False)
    assert "tilt not valid" in words and shown == "ERROR"


def test_losses_are_the_counters_that_are_not_zero() -> None:
    other = Status("driver", "OK", "", {"unreadable_messages": "3", "samples": "9"}, 0.5)
    assert losses([FILTER, other]) == ["driver: unreadable_messages 3"]


def test_losses_of_the_page_itself_are_said_as_well() -> None:
    rates = [StreamRate("imu/data", 200.0, 0.01), StreamRate("tilt", 9.0, 0.1, unreadable=2)]
    assert losses([FILTER], rates, 4) == ["tilt: unreadable 2", "page: not_finite 4"]


def test_wheels_that_the_filter_ignores_are_said_while_the_robot_balances() -> None:
    lifted = Status("filter_node", "WARN", "wheels ignored: lifted", {}, 0.5)
    words, level = state_in_words([lifted, BALANCING], False, True)
    assert words == "balancing with pid; wheels ignored: lifted" and level == "WARN"


@pytest.mark.parametrize(
    ("space", "full_name", "name"),
    [
        ("", "filter_node", "filter_node"),
        ("/", "/filter_node", "filter_node"),
        ("", "second/filter_node", None),
        ("/second", "second/filter_node", "filter_node"),
        ("/second", "filter_node", None),
        ("/second", "second/arm/servo", None),
        ("/second", "secondary/filter_node", None),
        ("", "imu: rate in/out", "imu: rate in/out"),
        ("/second", "second/imu: rate", "imu: rate"),
    ],
)
def test_diagnostics_belong_to_the_robot_of_their_namespace(
    space: str, full_name: str, name: str | None
) -> None:
    assert name_within(space, full_name) == name
