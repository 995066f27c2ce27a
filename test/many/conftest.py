from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from twbr_estimation.cli.simulate import write_simulated
from twbr_estimation.simulation import simulate


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tree of five short recordings: three good, a copy of one, and a damaged one."""
    folder = tmp_path_factory.mktemp("runs")
    for number in range(3):
        made = simulate("paper", 0.01, 3.0, 70 + number)
        write_simulated(folder / f"day{number % 2}" / f"run{number}", made)
    shutil.copytree(folder / "day0" / "run0", folder / "day1" / "copy")
    (bag,) = (folder / "day1" / "copy").glob("*.mcap")
    metadata = folder / "day1" / "copy" / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace(bag.name, "other.mcap"))
    bag.rename(bag.with_name("other.mcap"))
    (folder / "day0" / "damaged.mcap").write_bytes(b"no bag at all")
    return folder
