"""When a loop is interpreted, when compiled, and what is compiled ahead."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest

from twbr_estimation.batch import CorrectedTrack, precompile, run_filter, running
from twbr_estimation.batch.loops import CORRECTION, CompiledLoop, loop_of_filter
from twbr_estimation.filters import Filter, filter_named, filters
from twbr_estimation.robot import Robot
from twbr_estimation.samples import CorrectedSample


def track(samples: int) -> CorrectedTrack:
    """Return samples of a robot at rest, 10 ms apart."""
    values = dict.fromkeys(CorrectedSample._fields, 0.0)
    sample = CorrectedSample(**{**values, "dt": 0.01, "angle": 0.1, "accel_z": 9.8})
    columns = np.repeat(np.array(sample)[:, None], samples, axis=1)
    return CorrectedTrack(np.arange(samples, dtype=np.int64) * 10_000_000, columns)


class State(NamedTuple):
    tilt: float
    rate: float


class Parameters(NamedTuple):
    pass


def reset(estimate: Any, sample: Any, parameters: Any) -> State:
    return State(estimate.tilt, estimate.rate)


def fresh(step: Any) -> Filter:
    """Return a filter that no run before has compiled."""
    own = {"parameters": Parameters, "state": State, "reset": reset, "step": step}
    return replace(filter_named("gyro"), name="fresh", **own)


def test_a_loop_is_compiled_once_it_has_run_long_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    def step(state: Any, sample: Any, parameters: Any) -> State:
        return State(state.tilt + sample.angle * sample.dt, 0.0)

    monkeypatch.setattr(running, "COMPILE_AFTER", 250)
    entry, short = fresh(step), track(100)
    found, compiled = [], []
    for _ in range(3):
        found.append(run_filter(entry, Parameters(), short, Robot()))
        loop = loop_of_filter(entry, short.first, Parameters(), found[-1].state)
        compiled.append(loop.is_ready)
    assert compiled == [False, False, True]
    for other in found[1:]:
        np.testing.assert_array_equal(other.columns, found[0].columns)
        assert other.state == found[0].state


def test_a_run_goes_on_where_one_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    def step(state: Any, sample: Any, parameters: Any) -> State:
        return State(state.tilt + sample.angle * sample.dt, state.tilt)

    entry, whole = fresh(step), track(100)
    first = CorrectedTrack(whole.stamps[:40], whole.columns[:, :40].copy())
    second = CorrectedTrack(whole.stamps[40:], whole.columns[:, 40:].copy())
    begun = run_filter(entry, Parameters(), first, Robot())
    ended = run_filter(entry, Parameters(), second, Robot(), begun.state)
    joined = np.hstack([begun.columns, ended.columns])
    expected = run_filter(entry, Parameters(), whole, Robot()).columns
    np.testing.assert_array_equal(joined, expected)


def test_what_python_refuses_to_compute_is_compiled() -> None:
    def step(state: Any, sample: Any, parameters: Any) -> State:
        return State(math.exp(state.tilt * 10.0), 0.0)

    found = run_filter(fresh(step), Parameters(), track(20), Robot())
    assert math.isinf(found.tilt[-1])


def test_the_loops_that_are_missing_begin_with_the_slowest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(CompiledLoop, "is_ready", False)
    names = precompile.missing(filters().values())
    assert names[: len(precompile.SLOWEST_FIRST)] == list(precompile.SLOWEST_FIRST)
    assert set(names) == {CORRECTION, *filters()}
    assert precompile.missing([fresh(lambda state, sample, parameters: state)]) == ["correction"]
    monkeypatch.setattr(CompiledLoop, "is_ready", True)
    assert precompile.missing(filters().values()) == []
    precompile.compile_missing(filters().values())  # nothing to do, no process to start


def test_the_background_is_used_where_something_is_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    started: list[list[str]] = []
    monkeypatch.setattr(subprocess, "Popen", lambda command, **_: started.append(command))
    monkeypatch.setattr(precompile, "missing", lambda entries: ["kalman"])
    monkeypatch.setenv(precompile.NO_BACKGROUND, "1")
    assert not precompile.compile_later([filter_named("kalman")])
    monkeypatch.delenv(precompile.NO_BACKGROUND)
    assert precompile.compile_later([filter_named("kalman")])
    monkeypatch.setattr(precompile, "missing", lambda entries: [])
    assert not precompile.compile_later([filter_named("kalman")])
    module = "twbr_estimation.batch.precompile"
    assert started == [[sys.executable, "-m", module, "--background", "kalman"]]


def test_loops_are_compiled_in_processes_and_then_found(tmp_path: Any) -> None:
    """In a cache of its own; the process that asked finds them there."""
    program = (
        "from twbr_estimation.batch.precompile import compile_missing, missing\n"
        "from twbr_estimation.filters import filter_named\n"
        "if __name__ == '__main__':\n"
        "    entries = [filter_named('gyro')]\n"
        "    print(missing(entries)); seen = []\n"
        "    compile_missing(entries, lambda *done: seen.append(done))\n"
        "    print(missing(entries), seen)\n"
    )
    file = tmp_path / "ask.py"
    file.write_text(program)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    result = subprocess.run(
        [sys.executable, str(file)], env=environment, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stderr
    before, after = result.stdout.splitlines()
    assert before == "['correction', 'gyro']"
    assert after == "[] [(0, 2), (1, 2), (2, 2)]"


def test_names_that_are_no_filters_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert precompile.main(["no_such_filter"]) == 1
    assert "there is no filter 'no_such_filter'" in capsys.readouterr().err
