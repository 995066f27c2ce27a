"""Several filters at once in local processes."""

from __future__ import annotations

import os
import signal
from collections.abc import Mapping

from twbr_estimation.filters import filter_named
from twbr_estimation.tuning.filter import TuningTask, mean_square_error, tune_filter
from twbr_estimation.tuning.several import tune_filters
from twbr_estimation.workers.local_pool import LocalPool

NAMES = ["complementary", "alpha_beta_wob", "kalman_tuned"]


def ignore(name: str, figure: float, values: Mapping[str, float]) -> None:
    pass


def test_a_pool_finds_what_one_process_finds(task: TuningTask) -> None:
    heard: dict[str, float] = {}

    def report(name: str, figure: float, values: Mapping[str, float]) -> None:
        heard[name] = figure

    found = tune_filters(task, NAMES, LocalPool(2), report)
    assert found == [tune_filter(task, name) for name in NAMES]
    assert set(heard) == set(NAMES)
    for tuned in found:
        assert tuned.training_mse_deg2 <= heard[tuned.name] < 1.01 * tuned.training_mse_deg2


def test_ctrl_c_stops_the_pool_and_keeps_the_best_so_far(task: TuningTask) -> None:
    def interrupt(name: str, figure: float, values: Mapping[str, float]) -> None:
        if name == "alpha_beta_theta_wa_b":
            raise KeyboardInterrupt

    (begun,) = tune_filters(task, ["alpha_beta_theta_wa_b"], LocalPool(1), interrupt)
    assert begun.interrupted
    entry = filter_named(begun.name)
    assert begun.training_mse_deg2 == mean_square_error(entry, begun.values, task.training)


def test_a_process_that_dies_costs_no_result(task: TuningTask) -> None:
    killed: list[int] = []
    pool = LocalPool(1)

    def kill_once(name: str, figure: float, values: Mapping[str, float]) -> None:
        if name == NAMES[1] and not killed:
            killed.append(worker_of(os.getpid()))
            os.kill(killed[0], signal.SIGKILL)

    found = tune_filters(task, NAMES[:2], pool, kill_once)
    assert killed
    assert found == [tune_filter(task, name) for name in NAMES[:2]]


def worker_of(parent: int) -> int:
    """Return the only process that the pool's fork server has."""
    from multiprocessing.forkserver import _forkserver  # type: ignore[attr-defined]

    server = _forkserver._forkserver_pid
    (child,) = children(server)
    assert child != parent
    return child


def children(process: int) -> list[int]:
    with open(f"/proc/{process}/task/{process}/children") as file:
        return [int(number) for number in file.read().split()]
