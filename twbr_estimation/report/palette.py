"""Colours that people with any colour vision can distinguish (Okabe and Ito)."""

from __future__ import annotations

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C6D1F")
"""For estimators; yellow is left out, it is too pale on white."""
DASHES = ("solid", "dashed", "dotted", "dashdot")
"""Each colour comes once with each of these."""
MOTION = "#222222"
"""For the reference and the motion."""
ERROR_COLOURS = ("#A6A6A6", "#6E6E6E")
"""For the angle before and after the correction: greys, because it is no estimator."""
AXES = COLOURS[:3]
"""For x, y, z."""


def style_of(index: int) -> tuple[str, str]:
    """Return colour and dash of the estimator at an index; they repeat after 28."""
    return COLOURS[index % len(COLOURS)], DASHES[index // len(COLOURS) % len(DASHES)]
