"""Whatever ends a writer, the old content is there or the new, and nothing beside it."""

from __future__ import annotations

import os
import resource
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from twbr_estimation.disk import exchange, writing
from twbr_estimation.disk.partials import restore
from twbr_estimation.disk.writing import whole_file, whole_folder, write_text, write_texts
from twbr_estimation.errors import WritingError

OLD, NEW = "old\n" * 5000, "new\n" * 7000
WATCHED = ("open", "os.", "shutil.", "fcntl.", "ctypes.call")


def forked(work: Callable[[], object]) -> int:
    """Run `work` in a child and return how it ended, as `os.waitpid` gives it."""
    child = os.fork()
    if child == 0:
        try:
            work()
            os._exit(0)
        except WritingError:
            os._exit(3)
        except BaseException:
            os._exit(4)
    return os.waitpid(child, 0)[1]


def killed_at(instant: int, work: Callable[[], object]) -> bool:
    """Kill a child of ours at its `instant`-th operation on files; False where it ended first."""

    def watched() -> None:
        seen = 0

        def hook(event: str, arguments: object) -> None:
            nonlocal seen
            if event.startswith(WATCHED):
                seen += 1
                if seen == instant:
                    os.kill(os.getpid(), signal.SIGKILL)

        sys.addaudithook(hook)
        work()

    status = forked(watched)
    assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0
    return os.WIFSIGNALED(status)


def make_folder(path: Path, text: str) -> None:
    with whole_folder(path) as folder:
        folder.mkdir()
        (folder / "sub").mkdir()
        for name in ("a", "b", "sub/c"):
            (folder / name).write_text(text)


def folder_content(path: Path) -> set[str]:
    return {(path / name).read_text() for name in ("a", "b", "sub/c")}


def test_a_file_whose_writer_is_killed_at_any_instant_is_old_or_new(tmp_path: Path) -> None:
    target = tmp_path / "figures.json"
    found = set()
    for instant in range(1, 200):
        target.write_text(OLD)
        killed = killed_at(instant, lambda: write_text(target, NEW))
        found.add(target.read_text())
        write_text(target, NEW)
        assert os.listdir(tmp_path) == ["figures.json"], "a killed writer's leftover stays"
        if not killed:
            break
    assert instant > 8 and not killed and found == {OLD, NEW}


@pytest.mark.parametrize("can_exchange", [True, False])
def test_a_folder_whose_writer_is_killed_at_any_instant_is_old_or_new(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, can_exchange: bool
) -> None:
    if not can_exchange:
        monkeypatch.setattr(exchange, "exchange", _cannot)
    target = tmp_path / "bag"
    found = set()
    for instant in range(1, 300):
        make_folder(target, OLD)
        killed = killed_at(instant, lambda: make_folder(target, NEW))
        restore(target)
        content = folder_content(target)
        assert len(content) == 1, "a mixture of old and new"
        found |= content
        make_folder(target, NEW)
        assert os.listdir(tmp_path) == ["bag"]
        if not killed:
            break
    assert instant > 15 and not killed and found == {OLD, NEW}


def _cannot(first: Path, second: Path) -> None:
    raise OSError(22, "Invalid argument")


def test_several_files_are_all_old_where_one_cannot_be_written(tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("robot.yaml", "calibration.yaml")]
    for path in paths:
        path.write_text(OLD)
    contents = {paths[0]: NEW, paths[1]: NEW * 40}
    status = forked(lambda: with_largest_file(len(NEW) + 10, lambda: write_texts(contents)))
    assert os.WEXITSTATUS(status) == 3
    assert [path.read_text() for path in paths] == [OLD, OLD]
    assert sorted(os.listdir(tmp_path)) == ["calibration.yaml", "robot.yaml"]


def with_largest_file(size: int, work: Callable[[], object]) -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    work()


@pytest.mark.parametrize("size", [0, 1, 4096, len(NEW) - 1])
def test_a_full_disk_leaves_the_old_content(tmp_path: Path, size: int) -> None:
    file, folder = tmp_path / "file", tmp_path / "folder"
    file.write_text(OLD)
    make_folder(folder, OLD)
    for work in (lambda: write_text(file, NEW), lambda: make_folder(folder, NEW)):
        assert os.WEXITSTATUS(forked(lambda work=work: with_largest_file(size, work))) == 3
    assert file.read_text() == OLD and folder_content(folder) == {OLD}
    assert sorted(os.listdir(tmp_path)) == ["file", "folder"]


def test_a_full_disk_is_named_with_the_space_that_is_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path) -> None:
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(writing, "synchronised", full)
    with pytest.raises(
        WritingError, match=r"file: cannot be written: no space left .*up to 2.0 MB"
    ) as error:
        write_text(tmp_path / "file", "x" * 2_000_000)
    assert "free in" in str(error.value) and ".partial" not in str(error.value)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("target", ["/proc/sub/file", "/dev/null/file", "/sys/file"])
def test_a_place_that_cannot_be_written_is_named(target: str) -> None:
    with pytest.raises(WritingError, match=f"{target}: cannot be written: [a-z]"):
        write_text(Path(target), "x")
    with pytest.raises(WritingError, match=f"{target}: cannot be written: [a-z]"):
        make_folder(Path(target), "x")


def test_folders_made_for_a_file_that_fails_go_again(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), whole_file(tmp_path / "a" / "b" / "file"):
        raise ZeroDivisionError
    assert os.listdir(tmp_path) == []


def test_rights_and_links_stay(tmp_path: Path) -> None:
    real, link = tmp_path / "real", tmp_path / "link"
    real.write_text(OLD)
    real.chmod(0o640)
    link.symlink_to(real.name)
    write_text(link, NEW)
    assert link.is_symlink() and real.read_text() == NEW
    assert real.stat().st_mode & 0o777 == 0o640


def test_a_new_file_has_the_rights_that_the_umask_leaves(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_text(tmp_path / "file", NEW)
    finally:
        os.umask(before)
    assert (tmp_path / "file").stat().st_mode & 0o777 == 0o640


def test_a_pipe_is_written_to_and_a_folder_refused(tmp_path: Path) -> None:
    read, write = os.pipe()
    write_text(Path(f"/dev/fd/{write}"), "through\n")
    os.close(write)
    assert os.read(read, 100) == b"through\n"
    os.close(read)
    with pytest.raises(WritingError, match="is a directory"):
        write_text(tmp_path, NEW)


def test_another_writer_s_work_in_progress_is_left_alone(tmp_path: Path) -> None:
    target = tmp_path / "file"
    with whole_file(target) as slow:
        slow.write_text(OLD)
        write_text(target, NEW)
        assert slow.exists() and target.read_text() == NEW
    assert target.read_text() == OLD and os.listdir(tmp_path) == ["file"]


def test_what_appears_meanwhile_is_not_replaced_unasked(tmp_path: Path) -> None:
    def slow(target: Path) -> None:
        with whole_folder(target, replace=False) as folder:
            folder.mkdir()
            make_folder(target, NEW)

    with pytest.raises(WritingError, match="exists already"):
        slow(tmp_path / "bag")
    assert folder_content(tmp_path / "bag") == {NEW} and os.listdir(tmp_path) == ["bag"]


def test_many_writers_of_one_folder_leave_the_work_of_one(tmp_path: Path) -> None:
    target = tmp_path / "bag"
    children = []
    for number in range(6):
        child = os.fork()
        if child == 0:
            try:
                for _ in range(5):
                    make_folder(target, f"{number}\n" * 2000)
                os._exit(0)
            except BaseException:
                os._exit(1)
        children.append(child)
    assert [os.waitpid(child, 0)[1] for child in children] == [0] * 6
    assert len(folder_content(target)) == 1 and os.listdir(tmp_path) == ["bag"]
