"""Texts to values of parameters and back."""

from __future__ import annotations

from typing import Any

import pytest

from twbr_estimation.dashboard.values import text_of_value, value_of_text, whole
from twbr_estimation.errors import ConfigurationError


@pytest.mark.parametrize(
    "value",
    ["", "imu_link", "true", "a: [", "0.5", [], [1, 2], [1.5, -2.0], ["a", "b"], [True, False],
     ["x"] * 100],
)  # fmt: skip
def test_a_value_is_read_back_from_its_text(value: Any) -> None:
    text = text_of_value(value)
    assert "\n" not in text
    assert value_of_text(text, value) == value


def test_numbers_of_a_list_may_be_written_in_any_way() -> None:
    assert value_of_text("[1e-3, 2, 0.5]", [1.0]) == [0.001, 2.0, 0.5]
    assert value_of_text("[1, 2]", [7]) == [1, 2]
    assert value_of_text("[1e3]", ["a"]) == ["1e3"]


@pytest.mark.parametrize("text", ["", "3", "{", "[1, ", "a", "2020-13-45", "!!x [", "[" * 10_000])
def test_what_is_no_list_is_refused(text: str) -> None:
    with pytest.raises(ConfigurationError, match="is no list; write it as") as caught:
        value_of_text(text, [1.0])
    assert len(str(caught.value)) < 200


def test_a_whole_number_has_no_fraction() -> None:
    assert whole(3.0) == 3
    with pytest.raises(ConfigurationError, match=r"3\.5 is no whole number"):
        whole(3.5)
