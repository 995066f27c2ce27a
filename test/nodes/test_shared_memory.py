"""Segments of shared memory that a killed process left half made."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.nodes.shared_memory import remove_half_made


def segment(folder: Path, name: str, content: bytes, age: float) -> Path:
    path = folder / name
    path.write_bytes(content)
    os.utime(path, (time.time() - age,) * 2)
    return path


def test_only_what_is_no_longer_prepared_is_removed(tmp_path: Path) -> None:
    gone = {
        segment(tmp_path, "fastrtps_port7000", b"", 60.0),
        segment(tmp_path, "fastrtps_0023f5a0aad19a48", b"\1\0\0\0" + bytes(99), 60.0),
    }
    segment(tmp_path, "fastrtps_port7411", b"\2\0\0\0" + bytes(99), 60.0)  # prepared
    segment(tmp_path, "fastrtps_port7411_el", b"", 60.0)  # a lock is empty
    segment(tmp_path, "fastrtps_port7413", b"", 0.0)  # its creator may be at it
    segment(tmp_path, "other", b"", 60.0)
    kept = set(tmp_path.iterdir()) - gone
    assert set(remove_half_made(tmp_path)) == gone
    assert set(tmp_path.iterdir()) == kept


def test_what_cannot_be_removed_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = segment(tmp_path, "fastrtps_port7000", b"", 60.0)

    def refuse(self: Path, missing_ok: bool = False) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(ConfigurationError, match=f"{path}.*Operation not permitted.*UDPv4"):
        remove_half_made(tmp_path)
