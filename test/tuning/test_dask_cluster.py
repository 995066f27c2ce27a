"""A real scheduler and two workers on the loopback address, one of them killed on the way."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from twbr_estimation.cli.main import main
from twbr_estimation.cli.simulate import write_simulated
from twbr_estimation.configuration.files import read_settings
from twbr_estimation.errors import WorkerError
from twbr_estimation.simulation import simulate
from twbr_estimation.tuning.dask_cluster import DaskCluster
from twbr_estimation.tuning.filter import TunedFilter, TuningTask, tune_filter
from twbr_estimation.tuning.workers import Report, tune_filters

distributed = pytest.importorskip("distributed", reason="the extra `dask` is not installed")

NAMES = ["alpha_beta_theta_gamma", "alpha_beta_theta_wa_a", "alpha_beta_theta_wa_b", "kalman"]


class Cluster:
    """A scheduler and two workers, each a process."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "scheduler.json"
        self.scheduler = self._start("scheduler", "--port", "0", "--no-show")
        alone = ("--no-nanny", "--nthreads", "1", "--local-directory", str(folder))
        names = ("first", "second")
        self.workers = {name: self._start("worker", "--name", name, *alone) for name in names}

    def _start(self, role: str, *arguments: str) -> subprocess.Popen[bytes]:
        where = ("--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(self.file))
        command = [sys.executable, "-m", f"distributed.cli.dask_{role}", *where, *arguments]
        return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def address(self) -> str:
        """Wait for both workers and return the scheduler's address."""
        limit = time.monotonic() + 60.0
        while not self.file.exists():
            assert time.monotonic() < limit, "the scheduler did not start"
            time.sleep(0.05)
        with distributed.Client(scheduler_file=str(self.file), set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60.0)
            return str(client.scheduler.address)

    def kill_the_worker_on(self, unit: str, address: str) -> None:
        """Kill the worker that is busy with this unit."""
        for process in self.workers.values():
            process.send_signal(signal.SIGSTOP)  # nobody finishes anything meanwhile
        with distributed.Client(address, set_as_default=False) as client:
            busy = [worker for worker, keys in client.processing().items() if _has(keys, unit)]
            known = client.scheduler_info()["workers"]
        for worker in busy:
            process = self.workers[known[worker]["name"]]
            process.kill()
            process.wait()
        for process in self.workers.values():
            process.send_signal(signal.SIGCONT)

    def alive(self) -> int:
        return sum(process.poll() is None for process in self.workers.values())

    def close(self) -> None:
        for process in (*self.workers.values(), self.scheduler):
            process.kill()
            process.wait()


def _has(keys: Sequence[Any], unit: str) -> bool:
    return any(str(key).endswith(f"-{unit}") for key in keys)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    made = Cluster(tmp_path_factory.mktemp("cluster"))
    yield made
    made.close()


def test_the_command_sends_its_work_to_a_cluster(cluster: Cluster, tmp_path: Path) -> None:
    write_simulated(tmp_path / "bag", simulate("paper", 0.01, 10.0, 41))
    file = tmp_path / "filters.yaml"
    where = ["-o", str(file), "--dask", cluster.address()]
    assert main(["tune", str(tmp_path / "bag"), "--filter", "complementary", *where]) == 0
    assert set(read_settings(file).values) == {"complementary"}


class Watched:
    """A cluster whose results are counted as they come."""

    def __init__(self, cluster: DaskCluster) -> None:
        self.cluster = cluster
        self.finished: list[str] = []

    def tune(self, task: TuningTask, names: Sequence[str], report: Report) -> Iterator[TunedFilter]:
        for tuned in self.cluster.tune(task, names, report):
            self.finished.append(tuned.name)
            yield tuned


def test_a_worker_killed_on_the_way_costs_no_result(cluster: Cluster, task: TuningTask) -> None:
    address = cluster.address()
    dask = DaskCluster(address)
    watched = Watched(dask)
    latest: dict[str, float] = {}
    begun_again: set[str] = set()
    done_before: list[str] = []

    def kill_one(name: str, figure: float, values: Mapping[str, float]) -> None:
        starts = name not in latest
        if figure >= latest.get(name, math.inf):  # one search only ever improves
            begun_again.add(name)
        latest[name] = figure
        if starts and watched.finished and cluster.alive() == 2:
            done_before.extend(watched.finished)
            cluster.kill_the_worker_on(name, address)

    found = tune_filters(task, NAMES, watched, kill_one)
    dask.close()
    assert cluster.alive() == 1
    assert found == [tune_filter(task, name) for name in NAMES], "nothing is lost"
    assert begun_again, "the unit under way was done by the other worker"
    assert not begun_again & set(done_before), "nothing computed is thrown away"
    assert sorted(watched.finished) == sorted(NAMES)


def test_a_scheduler_that_does_not_answer_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("twbr_estimation.tuning.dask_cluster.CONNECT_TIMEOUT", 0.5)
    with pytest.raises(WorkerError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9"):
        DaskCluster("tcp://127.0.0.1:9")
