"""What is said while messages come that cannot be used."""

from __future__ import annotations

import pytest

from twbr_estimation.streams.guarded import came_instead


@pytest.mark.parametrize(
    ("refused", "expected"),
    [
        ({}, "waiting"),
        ({"not_finite": 0}, "waiting"),
        (
            {"imu_not_finite": 7, "unreadable": 2},
            "waiting; not usable: 7 imu_not_finite, 2 unreadable",
        ),
        (
            {"beyond_any_sensor": 9},
            "waiting; not usable: 9 beyond_any_sensor; counts of the chip? give rad/s and m/s^2",
        ),
    ],
)
def test_what_came_is_named_beside_what_is_waited_for(
    refused: dict[str, int], expected: str
) -> None:
    assert came_instead("waiting", refused) == expected
