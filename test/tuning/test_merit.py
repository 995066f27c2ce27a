"""The figure of a setting, and the errors that a search keeps of it."""

from __future__ import annotations

import numpy as np
import pytest

from twbr_estimation.tuning.filter import TuningTask
from twbr_estimation.tuning.merit import KEPT_ERRORS, merit_of
from twbr_estimation.tuning.objective import Objective


@pytest.mark.parametrize("objective", [Objective(), Objective(0.01, 1e-4)])
def test_squares_of_the_errors_add_up_to_the_figure(task: TuningTask, objective: Objective) -> None:
    def late(each: object) -> np.ndarray:
        return np.roll(task.training[0].corrected.field("angle"), 2)

    found = merit_of(task.training[:1], late, objective)
    assert float(found.errors @ found.errors) == pytest.approx(found.figure, rel=1e-9)


def test_long_recordings_keep_some_errors_only(
    task: TuningTask, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = merit_of(task.training, lambda each: each.corrected.field("angle"), Objective())
    monkeypatch.setattr("twbr_estimation.tuning.merit.KEPT_ERRORS", 800)
    some = merit_of(task.training, lambda each: each.corrected.field("angle"), Objective())
    assert some.figure == whole.figure
    assert some.errors.size < 1000 < whole.errors.size <= KEPT_ERRORS
    assert float(some.errors @ some.errors) == pytest.approx(whole.figure, rel=0.2)
