from __future__ import annotations

import pytest

from twbr_estimation.simulation import simulate
from twbr_estimation.tuning.filter import TuningTask
from twbr_estimation.tuning.objective import TuningSet, prepare


def simulated_set(seed: int, duration: float = 20.0) -> TuningSet:
    made = simulate("paper", 0.01, duration, seed)
    return prepare(made.drive)


@pytest.fixture(scope="session")
def task() -> TuningTask:
    return TuningTask((simulated_set(31), simulated_set(32)), (simulated_set(33),))
