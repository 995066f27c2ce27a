"""A real scheduler and two workers on the loopback address, killed and restarted on the way."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from twbr_estimation.cli.main import main
from twbr_estimation.cli.simulate import write_simulated
from twbr_estimation.configuration.files import read_settings
from twbr_estimation.errors import WorkerError
from twbr_estimation.simulation import simulate
from twbr_estimation.workers import UnitResult, Work
from twbr_estimation.workers.dask_cluster import DaskCluster
from workers.cluster import Cluster
from workers.work import refuses, slow, squared

pytest.importorskip("distributed", reason="the extra `dask` is not installed")
LIMIT = 90.0


class Running:
    """A run in a thread, whose outcomes are collected."""

    def __init__(self, dask: DaskCluster, work: Work, units: Sequence[Any]) -> None:
        self.outcomes: list[UnitResult] = []
        self._arguments = dask, work, units
        self._thread = Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        dask, work, units = self._arguments
        self.outcomes.extend(dask.run(work, units, lambda message: None))

    def results(self) -> list[Any]:
        """Wait for the end and return what was found."""
        self._thread.join(LIMIT)
        assert not self._thread.is_alive()
        return sorted(each.result for each in self.outcomes)


def begun(folder: Path) -> dict[int, int]:
    """Wait until a unit is at work, and return the processes by unit."""
    limit = time.monotonic() + LIMIT
    while not (found := [path.name.split(".") for path in folder.glob("*.*")]):
        assert time.monotonic() < limit
        time.sleep(0.02)
    return {int(unit): int(process) for unit, process in found}


def test_a_cluster_does_the_work_and_takes_units_as_it_can(cluster: Cluster) -> None:
    dask, messages = DaskCluster(cluster.address), list[str]()
    with closing(dask):
        outcomes = list(dask.run(Work(squared, 1), range(30), messages.append))
        assert sorted(each.result for each in outcomes) == [n * n + 1 for n in range(30)]
        assert set(messages) <= {f"at {number}" for number in range(30)} and messages
        with pytest.raises(ValueError, match="unit 3"):
            list(dask.run(Work(refuses, None), [3], messages.append))


def test_a_worker_killed_on_the_way_costs_no_result(cluster: Cluster, tmp_path: Path) -> None:
    with closing(DaskCluster(cluster.address)) as dask:
        running = Running(dask, Work(slow, tmp_path), range(9))
        victim = cluster.worker_of(next(iter(begun(tmp_path).values())))
        victim.kill()
        victim.wait()
        (tmp_path / "go").touch()
        assert running.results() == list(range(9))
    assert cluster.alive() == 1


def test_all_workers_and_the_scheduler_may_be_restarted(cluster: Cluster, tmp_path: Path) -> None:
    with closing(DaskCluster(cluster.address)) as dask:
        running = Running(dask, Work(slow, tmp_path), range(9))
        begun(tmp_path)
        cluster.kill()
        cluster.start()
        (tmp_path / "go").touch()
        assert running.results() == list(range(9))


def test_the_command_sends_its_work_to_a_cluster(cluster: Cluster, tmp_path: Path) -> None:
    write_simulated(tmp_path / "bag", simulate("paper", 0.01, 10.0, 41))
    file = tmp_path / "filters.yaml"
    where = ["-o", str(file), "--dask", cluster.address]
    assert main(["tune", str(tmp_path / "bag"), "--filter", "complementary", *where]) == 0
    assert set(read_settings(file).values) == {"complementary"}


def test_a_scheduler_that_does_not_answer_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("twbr_estimation.workers.dask_cluster.CONNECT_TIMEOUT", 0.5)
    with pytest.raises(WorkerError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9"):
        DaskCluster("tcp://127.0.0.1:9")
