"""The robust spread that every check of motion uses."""

from __future__ import annotations

import numpy as np
import pytest

from twbr_estimation.checks.rows import spread


@pytest.mark.parametrize("size", [1, 2, 3, 4, 17, 18, 1000, 1001])
def test_the_spread_is_that_of_the_median_to_the_last_bit(size: int) -> None:
    generator = np.random.default_rng(size)
    for _ in range(20):
        values = generator.normal(size=size) * 10.0 ** generator.integers(-200, 200)
        assert spread(values) == 1.4826 * float(np.median(np.abs(values)))


def test_the_spread_of_what_is_not_known_is_not_known() -> None:
    assert np.isnan(spread(np.array([1.0, np.nan, 2.0, 3.0])))
    assert spread(np.empty(0)) == 0.0
