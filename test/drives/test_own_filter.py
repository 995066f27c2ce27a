"""Filters that are not part of the package: run, compiled or not, and never taken for another."""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest

import twbr_estimation as twbr
from twbr_estimation.batch import running
from twbr_estimation.pipeline.tilt_filter import TiltFilter

OWN = Path(__file__).resolve().parents[2] / "examples" / "python" / "own_filter.py"


@pytest.fixture(scope="module")
def drive() -> twbr.Drive:
    made = twbr.simulate("W1", seed=3, dt=0.01, duration=3.0)
    assert made.corrected.stamps.size == 300  # by the interpreter, before a test compiles loops
    return made


def loaded(path: Path) -> ModuleType:
    specification = importlib.util.spec_from_file_location(path.stem, path)
    assert specification is not None and specification.loader is not None
    module = sys.modules[path.stem] = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def stepped(entry: twbr.Filter, drive: twbr.Drive) -> list[twbr.TiltEstimate]:
    """Return what the filter gives on a live stream."""
    live = TiltFilter(entry, robot=drive.setup.robot)
    samples = drive.corrected.columns.T.tolist()
    return [live.step(twbr.CorrectedSample(*column)) for column in samples]


@pytest.mark.parametrize("compile_after", [running.COMPILE_AFTER, 0])
def test_an_own_filter_gives_the_same_compiled_and_interpreted(
    drive: twbr.Drive, monkeypatch: pytest.MonkeyPatch, compile_after: int
) -> None:
    mine = loaded(OWN).MINE
    monkeypatch.setattr(running, "COMPILE_AFTER", compile_after)
    runs = drive.run(mine, "complementary")
    np.testing.assert_array_equal(runs["mine"].columns.T, stepped(mine, drive))
    assert list(runs.scores().estimators) == ["mine", "complementary"]
    assert "mine.tilt" in runs.to_columns()
    assert twbr.Estimator(mine).step(0.0, (0, 0, 0), (0, 0, 9.81)).tilt == 0.0


def test_an_own_filter_that_cannot_start_with_a_sample_may_start_with_the_next() -> None:
    mine, failures = loaded(OWN).MINE, [ArithmeticError("no")]

    def reset(*arguments: Any) -> Any:
        if failures:
            raise failures.pop()
        return mine.reset(*arguments)

    estimator = twbr.Estimator(replace(mine, reset=reset), machine_code=False)
    with pytest.raises(ArithmeticError):
        estimator.step(0.0, (0, 0, 0), (0, 0, 9.81))
    for _ in range(3):
        assert estimator.step(0.01, (0, 0, 0), (0, 0, 9.81)).tilt == 0.0


def test_a_change_of_its_file_is_seen_at_once(
    drive: twbr.Drive, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(running, "COMPILE_AFTER", 0)
    file = tmp_path / "changing.py"
    source = OWN.read_text()
    tilts = []
    for text in (source, source.replace("tilt = state.tilt +", "tilt = 0.5 + state.tilt +")):
        file.write_text(text)
        tilts.append(drive.run(loaded(file).MINE)["mine"].tilt)
    assert np.all(np.abs(tilts[1][1:5] - tilts[0][1:5]) > 0.4)  # before they are half a turn apart


class Remembered(NamedTuple):
    """A state that cannot be compiled."""

    tilt: float
    rate: float
    history: Any


def test_what_cannot_be_compiled_runs_interpreted(
    drive: twbr.Drive, monkeypatch: pytest.MonkeyPatch
) -> None:
    def reset(estimate: Any, sample: Any, parameters: Any) -> Remembered:
        return Remembered(estimate.tilt, estimate.rate, {"angles": [sample.angle]})

    def step(state: Remembered, sample: Any, parameters: Any) -> Remembered:
        angles = [*state.history["angles"][-9:], sample.angle]
        return Remembered(sum(angles) / len(angles), sample.gyro_y, {"angles": angles})

    monkeypatch.setattr(running, "COMPILE_AFTER", 0)
    entry = replace(loaded(OWN).MINE, name="mean", state=Remembered, reset=reset, step=step)
    found = drive.run(entry)["mean"]
    np.testing.assert_array_equal(found.columns.T, stepped(entry, drive))


def test_its_own_mistakes_are_shown_as_they_are(drive: twbr.Drive) -> None:
    def step(state: Any, sample: Any, parameters: Any) -> Any:
        return state._replace(tilt=sample.no_such_field)

    with pytest.raises(AttributeError, match="no_such_field"):
        drive.run(replace(loaded(OWN).MINE, step=step))
