"""MATLAB files that are damaged, or hold something else, are refused in words."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_matrix

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


def spoilt(row: int, value: float) -> np.ndarray:
    """Return readings of which one is none."""
    values = np.ones(600)
    values[row] = value
    return values


def write(path: Path, **changed: Any) -> Path:
    savemat(path, {**good(), **changed}, do_compression=True)
    return path


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"all_encoder": np.zeros(100)}, "one length"),
        ({"all_time": "abc"}, "all_time is text; datenum or str2double"),
        ({"all_time": np.array([[1.0], "a"], dtype=object)}, "all_time is a cell array; cell2mat"),
        ({"all_time": csc_matrix(np.eye(600))}, "all_time is a sparse matrix; full"),
        ({"all_time": 1j * np.ones(600)}, "all_time holds complex numbers"),
        ({"all_time": np.zeros(600)}, "all_time does not increase"),
        ({"all_time": -np.arange(600.0)}, "all_time does not increase"),
        ({"all_gyro_2_y": spoilt(5, 1e300)}, r"all_gyro_2_y holds 1 values .* 1e\+300 in row 6"),
        ({"all_imu2_q1": spoilt(7, -1e9)}, "all_imu2_q1 holds 1 values .* in row 8"),
        ({"all_time": np.zeros(0)}, "one length"),
        ({"all_time": np.zeros((600, 3))}, "all_time is not a row"),
        ({"all_time": 1e30 * np.arange(600)}, "all_time reaches"),
        ({"all_time": {"a": 1}}, "all_time is a struct; save with '-struct'"),
        ({"all_time": np.full(600, np.nan)}, "all_time is not a row of finite"),
        ({name: np.zeros(1) for name in good()}, "is not a row of finite"),
    ],
)
def test_variables_of_another_kind_are_named(
    tmp_path: Path, changed: dict[str, Any], what: str
) -> None:
    with pytest.raises(TwbrError, match=what):
        load(write(tmp_path / "log.mat", **changed), "uiuc", ImportOptions())


def hand_held() -> dict[str, Any]:
    """Variables of a recording by motion capture."""
    time = 0.01 * np.arange(600)
    wave = np.stack([np.sin(time + phase) for phase in (0.0, 1.0, 2.0)], axis=1)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (600, 1))
    return {
        "imu_gyr": wave,
        "imu_acc": np.add(wave, [0.0, 0.0, 9.8]),
        "opt_quat": still,
        "opt_pos": 0.1 * wave,
        "movement": time > 1.0,
        "sampling_rate": 100.0,
    }


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"imu_gyr": hand_held()["imu_gyr"].T}, "imu_gyr: a row for each axis; transpose"),
        ({"imu_gyr": np.full((600, 3), np.nan)}, "imu_gyr holds 1800 values .* nan in row 1"),
        ({"opt_pos": np.full((600, 3), np.nan)}, "known together in 0 rows; 100 are needed"),
        ({"sampling_rate": "100"}, "sampling_rate is text"),
        ({"movement": np.zeros((600, 2))}, "movement has shape"),
    ],
)
def test_another_set_s_variables_are_named_as_well(
    tmp_path: Path, changed: dict[str, Any], what: str
) -> None:
    savemat(tmp_path / "log.mat", hand_held())
    assert load(tmp_path / "log.mat", "broad", ImportOptions()).recording.imu.stamps.size == 600
    savemat(tmp_path / "log.mat", {**hand_held(), **changed})
    with pytest.raises(TwbrError, match=what):
        load(tmp_path / "log.mat", "broad", ImportOptions())


def test_fields_of_a_struct_are_no_variables(tmp_path: Path) -> None:
    savemat(tmp_path / "log.mat", {"data": good()})
    with pytest.raises(TwbrError, match=r"no variable all_time.* it has data \(struct\)"):
        load(tmp_path / "log.mat", "uiuc", ImportOptions())


@pytest.mark.parametrize("head", [b"MATLAB 7.3 MAT-file, Platform: GLNXA64", b"\x89HDF\r\n\x1a\n"])
def test_version_7_3_is_named_with_what_to_do(tmp_path: Path, head: bytes) -> None:
    path = tmp_path / "log.mat"
    path.write_bytes(head.ljust(512, b" ") + b"\x89HDF\r\n\x1a\n" + bytes(500))
    with pytest.raises(TwbrError, match=r"version 7.3 \(HDF5\).*'-v7'"):
        load(path, "uiuc", ImportOptions())


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
