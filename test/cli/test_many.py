"""`twbr VERB` on many recordings, as a user meets it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from campaign.conftest import runs  # noqa: F401  (a fixture)
from twbr_estimation.cli.main import INTERRUPTED, main

FILTERS = ("--filter", "complementary", "--filter", "gyro")


def test_evaluate_takes_folders_and_patterns_and_names_what_failed(
    runs: Path,  # noqa: F811
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    table, figures = tmp_path / "table.jsonl", tmp_path / "figures.json"
    command = ["evaluate", str(runs), *FILTERS, "--results", str(table), "--json", str(figures)]
    assert main(command) == 1
    captured = capsys.readouterr()
    assert "mean over 4 recordings" in captured.out
    assert f"failed: {runs}/day0/damaged.mcap: " in captured.err
    document = json.loads(figures.read_text())
    assert len(document["recordings"]) == 4 and len(document["failed"]) == 1
    before = table.read_bytes()
    assert main([*command[:-1], str(tmp_path / "again.json"), "--jobs", "2"]) == 1
    assert table.read_bytes() == before, "nothing was computed"
    assert json.loads((tmp_path / "again.json").read_text()) == document
    capsys.readouterr()
    assert main(["evaluate", f"{runs}/day*/run*", *FILTERS, "--json", "-"]) == 0
    assert len(json.loads(capsys.readouterr().out)["recordings"]) == 3


def test_one_recording_with_workers_gives_what_it_gives_without(
    runs: Path,  # noqa: F811
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    bag = str(runs / "day0" / "run0")
    assert main(["evaluate", bag, *FILTERS]) == 0
    plain = capsys.readouterr()
    assert main(["evaluate", bag, *FILTERS, "--jobs", "2"]) == 0
    assert capsys.readouterr().out == plain.out
    assert main(["evaluate", bag, *FILTERS, "--jobs", "0"]) == 1
    assert "--jobs 0: at least 1 is needed" in capsys.readouterr().err


def test_ctrl_c_keeps_what_is_done_and_prints_no_traceback(
    runs: Path,  # noqa: F811
    tmp_path: Path,
) -> None:
    many = tmp_path / "many"
    many.mkdir()
    bag = next((runs / "day0" / "run0").glob("*.mcap")).read_bytes()
    for number in range(60):
        (many / f"run{number}.mcap").write_bytes(bag + bytes(number))  # each another content
    table = tmp_path / "table.jsonl"
    command = [sys.executable, "-m", "twbr_estimation.cli.main", "evaluate", str(many)]
    process = subprocess.Popen(
        [*command, "--jobs", "2", "--results", str(table)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    limit = time.monotonic() + 120.0
    while not (table.exists() and table.stat().st_size) and process.poll() is None:
        assert time.monotonic() < limit
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=120.0)
    assert process.returncode == INTERRUPTED
    assert "Traceback" not in errors
    assert f"interrupted; the results so far are in {table}" in errors
    rows = [json.loads(line) for line in table.read_text().splitlines()]
    assert 0 < len(rows) and all(row["version"] for row in rows)
