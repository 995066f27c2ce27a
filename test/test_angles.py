"""Angles are wrapped in one place."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twbr_estimation.angles import TURN, wrapped


def test_angles_are_wrapped_into_half_a_turn() -> None:
    angles = np.array([0.0, 1.0, -1.0, 4.0, -4.0, 100.0])
    expected = [math.remainder(angle, TURN) for angle in angles]
    assert wrapped(angles) == pytest.approx(expected)
    assert wrapped(np.array(7.0)).shape == ()
