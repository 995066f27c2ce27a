"""Folders, patterns and addresses that stand for recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from twbr_estimation.drives import load
from twbr_estimation.errors import ConfigurationError, RecordingError
from twbr_estimation.many.digests import content_of
from twbr_estimation.many.places import local_copy, recordings_at

ALL = ["day0/damaged.mcap", "day0/run0", "day0/run2", "day1/copy", "day1/run1"]


def test_a_folder_stands_for_what_lies_below_it_and_a_recording_for_itself(runs: Path) -> None:
    assert recordings_at([runs]) == [str(runs / name) for name in ALL]
    assert recordings_at([runs / "day1" / "run1"]) == [str(runs / "day1" / "run1")]
    assert recordings_at(["not/there"]) == ["not/there"], "which fails where it is read"


def test_a_pattern_stands_for_what_matches(runs: Path) -> None:
    assert recordings_at([f"{runs}/day*/run*"]) == [
        str(runs / name) for name in ("day0/run0", "day0/run2", "day1/run1")
    ]
    assert recordings_at([f"{runs}/day?"]) == [str(runs / name) for name in ALL]
    files = recordings_at([f"{runs}/**/*.mcap"])
    assert len(files) == len(ALL) and all(name.endswith(".mcap") for name in files)
    with pytest.raises(ConfigurationError, match="no recording matches"):
        recordings_at([f"{runs}/night*"])


def test_a_folder_with_a_bag_and_its_configuration_is_one_recording(runs: Path, tmp_path: Path):
    (tmp_path / "config").symlink_to(runs / "day0" / "run0" / "config")
    (tmp_path / "any.mcap").symlink_to(next((runs / "day0" / "run0").glob("*.mcap")))
    assert recordings_at([tmp_path]) == [str(tmp_path)]


def test_addresses_are_listed_and_fetched(runs: Path) -> None:
    pytest.importorskip("fsspec", reason="the extra `dask` is not installed")
    found = recordings_at([f"file://{runs}"])
    assert found == [f"file://{runs / name}" for name in ALL]
    (place,) = recordings_at([f"file://{runs}/day1/run*"])
    with local_copy(place) as path:
        fetched = load(path)
    own = load(runs / "day1" / "run1")
    assert fetched.setup == own.setup
    assert np.array_equal(fetched.recording.imu.gyro, own.recording.imu.gyro)
    with pytest.raises(RecordingError, match="cannot be fetched"):
        content_of("file:///not/there.mcap")
    with pytest.raises(ConfigurationError, match="cannot be opened"):
        recordings_at(["unheardof://host/runs"])


def test_content_is_that_of_the_bytes_and_the_configuration(runs: Path, tmp_path: Path) -> None:
    original, copy = runs / "day0" / "run0", runs / "day1" / "copy"
    assert content_of(str(original)) == content_of(str(copy))
    assert content_of(str(original))[0] != content_of(str(runs / "day1" / "run1"))[0]
    other = tmp_path / "other"
    with local_copy(f"file://{original}") as fetched:
        fetched.rename(other)
        other_content = content_of(str(other))
        assert other_content == content_of(str(original))
        (other / "config" / "robot.yaml").write_text("")
        assert content_of(str(other)) != other_content
