"""Which files are one recording, without metadata or with wrong ones."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from twbr_estimation.bags import read_recording, recordings_below, write_recording
from twbr_estimation.bags.bag_files import bag_files
from twbr_estimation.errors import RecordingError
from twbr_estimation.recording import Recording

Make = Callable[..., Recording]


def folder_of(path: Path, *names: str) -> Path:
    path.mkdir()
    for name in names:
        (path / name).write_bytes(b"bag")
    return path


def names_of(path: Path) -> list[str]:
    return [file.name for file in bag_files(path)[0]]


@pytest.mark.parametrize(
    "names",
    [
        ("a_0.mcap", "a_1.mcap", "a_2.mcap"),
        ("a_0.db3", "a_1.db3.zstd"),
        tuple(f"a_{number}.mcap" for number in range(12)),
        ("loose_3.mcap", "loose_4.mcap"),
        ("anything.mcap",),
    ],
)
def test_parts_of_one_recording_are_one(tmp_path: Path, names: tuple[str, ...]) -> None:
    folder = folder_of(tmp_path / "loose", *names)
    assert names_of(folder) == list(names)
    below = recordings_below(folder)
    assert below == [folder] or (len(names) == 1 and below == [folder / names[0]])


@pytest.mark.parametrize(
    "names",
    [
        ("monday.mcap", "tuesday.mcap"),
        ("a_0.mcap", "b_0.mcap"),
        ("a_1.mcap", "a_2.mcap"),
        ("a_0.mcap", "a_2.mcap"),
        ("loose_0.mcap", "monday.mcap"),
    ],
)
def test_other_files_are_several_recordings(tmp_path: Path, names: tuple[str, ...]) -> None:
    folder = folder_of(tmp_path / "loose", *names)
    assert recordings_below(folder) == [folder / name for name in names]
    with pytest.raises(RecordingError, match=f"several recordings: {names[0]}, {names[1]}"):
        bag_files(folder)


def test_parts_beside_other_recordings_are_no_whole_folder(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "loose", "a_0.mcap", "a_1.mcap")
    folder_of(folder / "more", "b.mcap")
    assert len(recordings_below(folder)) == 3


def test_what_is_there_unpacked_is_not_read_twice(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "loose", "a.mcap", "a.mcap.zstd")
    assert names_of(folder) == ["a.mcap"]


def with_names(folder: Path, change: Callable[[str], str]) -> Path:
    """Let the metadata of a recording list other names."""
    file = folder / "metadata.yaml"
    content = yaml.safe_load(file.read_text())
    information = content["rosbag2_bagfile_information"]
    information["relative_file_paths"] = [
        change(name) for name in information["relative_file_paths"]
    ]
    file.write_text(yaml.safe_dump(content))
    return folder


@pytest.mark.parametrize(
    ("change", "remark"),
    [
        (lambda name: "before_it_was_renamed_0.mcap", True),
        (lambda name: f"bags\\{name}", False),
        (lambda name: f"C:\\data\\{name}", False),
        (lambda name: f"/home/somebody/{name}", False),
    ],
)
def test_metadata_with_other_names_refuse_nothing(
    tmp_path: Path, small_recording: Make, change: Callable[[str], str], remark: bool
) -> None:
    recording = small_recording()
    write_recording(tmp_path / "bag", recording)
    found = read_recording(with_names(tmp_path / "bag", change))
    assert found.imu.stamps.size == recording.imu.stamps.size
    expected = "metadata.yaml lists missing files: before_it_was_renamed_0.mcap; the bag files "
    assert any(each.startswith(expected) for each in found.repairs) == remark


def test_the_metadata_stand_for_their_folder(tmp_path: Path, small_recording: Make) -> None:
    write_recording(tmp_path / "bag", small_recording())
    assert read_recording(tmp_path / "bag" / "metadata.yaml").imu.stamps.size > 0


@pytest.mark.parametrize("content", [b"", bytes(5000), b"hello" * 500])
def test_a_part_that_is_no_bag_is_left_out_and_named(
    tmp_path: Path, content: bytes, small_recording: Make
) -> None:
    write_recording(tmp_path / "drive", small_recording(200))
    (good,) = (tmp_path / "drive").glob("*.mcap")
    folder = folder_of(tmp_path / "split", "split_0.mcap", "split_1.mcap")
    (folder / "split_1.mcap").write_bytes(good.read_bytes())
    (folder / "split_0.mcap").write_bytes(content)
    read = read_recording(folder)
    assert read.imu.stamps.size == 200
    (repair,) = (text for text in read.repairs if "split_0.mcap" in text)
    assert repair.startswith("split_0.mcap: this part is left out: ")
    (folder / "split_1.mcap").write_bytes(content)
    with pytest.raises(RecordingError, match=r"split_0\.mcap: "):
        read_recording(folder)
