"""MATLAB files that are damaged, or hold something else, are refused in words."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from twbr_estimation.errors import TwbrError
from twbr_estimation.imports import ImportOptions, load

NAMES = [f"all_{kind}_2_{axis}" for kind in ("gyro", "accel") for axis in "xyz"]
NAMES += [f"all_imu2_q{i}" for i in range(1, 5)]


def good() -> dict[str, Any]:
    time = 0.01 * np.arange(600)
    return {
        "all_time": time,
        "all_encoder": 90.0 + 30.0 * np.sin(time),
        **{name: np.cos(time + i) for i, name in enumerate(NAMES)},
    }


def write(path: Path, **changed: Any) -> Path:
    savemat(path, {**good(), **changed}, do_compression=True)
    return path


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"all_encoder": np.zeros(100)}, "one length"),
        ({"all_time": "abc"}, "all_time holds no real numbers"),
        ({"all_time": np.zeros(0)}, "one length"),
        ({"all_time": np.zeros((600, 3))}, "all_time is not a row"),
        ({"all_time": 1e30 * np.arange(600)}, "all_time reaches"),
        ({"all_time": {"a": 1}}, "all_time holds no real numbers"),
        ({"all_time": np.full(600, np.nan)}, "all_time is not a row of finite"),
        ({name: np.zeros(1) for name in good()}, "is not a row of finite"),
    ],
)
def test_variables_of_another_kind_are_named(
    tmp_path: Path, changed: dict[str, Any], what: str
) -> None:
    with pytest.raises(TwbrError, match=what):
        load(write(tmp_path / "log.mat", **changed), "uiuc", ImportOptions())


def test_damaged_files_are_read_or_refused(tmp_path: Path) -> None:
    chance = random.Random(3)
    content = write(tmp_path / "log.mat").read_bytes()
    path, refused = tmp_path / "damaged.mat", 0
    for _ in range(150):
        length = chance.choice([len(content), chance.randrange(1, len(content))])
        changed = bytearray(content[:length])
        for _ in range(chance.randint(1, 8)):
            changed[chance.randrange(min(len(changed), 4000))] = chance.randrange(256)
        path.write_bytes(bytes(changed))
        try:
            load(path, "uiuc", ImportOptions())
        except TwbrError:
            refused += 1
    assert refused > 100
