"""The examples and the notebook run as they stand, on a short recording."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twbr_estimation.cli.simulate import write_simulated
from twbr_estimation.simulation import simulate

FOLDER = Path(__file__).resolve().parent.parent / "examples" / "python"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Thirty seconds at 100 Hz with the robot's description."""
    path = tmp_path_factory.mktemp("examples") / "bag"
    write_simulated(path, simulate("W2", 0.01, 30.0, 12))
    return path


def imported(name: str) -> Any:
    """Return an example as a module."""
    specification = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    assert specification is not None and specification.loader is not None
    module = sys.modules[name] = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_the_comparison_prints_draws_and_saves(
    bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib").use("Agg")
    imported("compare").main(str(bag), str(tmp_path))
    printed = capsys.readouterr().out
    assert "ins_odometer" in printed and "tilt at 29.99 s" in printed
    assert (tmp_path / "tilt.png").read_bytes().startswith(b"\x89PNG")
    table = np.genfromtxt(tmp_path / "tilt.csv", delimiter=",", names=True)
    assert table.shape == (3000,)


def test_the_own_filter_is_scored_beside_ours(
    bag: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    imported("own_filter").main(str(bag))
    printed = capsys.readouterr().out
    assert printed.count("│ mine") == printed.count("│ complementary") == 2


def test_every_cell_of_the_notebook_runs(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib").use("Agg")
    notebook = json.loads((FOLDER / "recording.ipynb").read_text())
    assert notebook["nbformat"] == 4
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    named = "../../bags/verification"
    assert sum(named in cell for cell in cells) == 1 and (FOLDER / named).is_dir()
    space: dict[str, Any] = {}
    for index, source in enumerate(cells):
        exec(compile(source.replace(named, str(bag)), f"cell {index}", "exec"), space)
    assert np.isfinite(space["estimate"].tilt)
    assert capsys.readouterr().out.count("RMSE") == 2
    assert not any(cell.get("outputs") for cell in notebook["cells"]), "clear the outputs"
