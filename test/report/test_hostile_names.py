"""A picture of estimators and a recording whose names are formulas or hold escape codes."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from twbr_estimation.report.pictures import tilt_picture
from twbr_estimation.report.traces import Trace

pytest.importorskip("matplotlib", reason="the extra `report` is not installed")

FORMULA = "a$x_{$b\x1b[31m"
"""No valid formula: matplotlib raises where it reads it as one, and has no glyph for the last."""


def test_names_are_drawn_as_they_are(tmp_path: Path) -> None:
    times = np.arange(10.0)
    trace = Trace(FORMULA, "black", "solid", True, times, times, times, times)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tilt_picture([trace], FORMULA, tmp_path / "tilt.png")
    assert (tmp_path / "tilt.png").read_bytes().startswith(b"\x89PNG")
