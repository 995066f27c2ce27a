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

from many.conftest import runs  # noqa: F401  (a fixture)
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


def test_check_and_noise_take_many_recordings_and_repeat_nothing(
    runs: Path,  # noqa: F811
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for verb in ("check", "noise"):
        table = tmp_path / f"{verb}.jsonl"
        command = [verb, str(runs), "--results", str(table), "--json", "-"]
        main(command)
        first = capsys.readouterr()
        assert "damaged.mcap" in first.err
        before = table.read_bytes()
        assert main(command) == 1
        assert capsys.readouterr().out == first.out
        rows = [json.loads(line) for line in before.splitlines()]
        kept = [row for row in rows if row["key"]]
        assert len(kept) == 4 and table.read_bytes().startswith(before)
    assert main(["check", str(runs / "day0" / "run0"), "--json", "-"]) in (0, 1)
    (alone,) = json.loads(capsys.readouterr().out)["recordings"]
    main(["check", f"{runs}/day0/run0", "--jobs", "1", "--json", "-"])
    assert json.loads(capsys.readouterr().out)["recordings"] == [alone]


def test_a_report_of_many_recordings_has_a_page_each_and_a_list(
    runs: Path,  # noqa: F811
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("bokeh", reason="the extra `report` is not installed")
    output, table = tmp_path / "made", tmp_path / "table.jsonl"
    command = ["report", str(runs), *FILTERS, "-o", str(output), "--results", str(table)]
    assert main(command) == 1
    assert "damaged.mcap" in capsys.readouterr().err
    index = (output / "report.html").read_text()
    pages = sorted(path.parent.name for path in output.glob("*/report.html"))
    assert len(pages) == 3, "a copy shares its page"
    assert all(f'href="{page}/report.html"' in index for page in pages)
    assert "damaged.mcap" in index
    assert main(command) == 1 and "exists already" in capsys.readouterr().err
    (output / pages[0] / "report.html").unlink()
    rows = len(table.read_text().splitlines())
    assert main([*command, "--overwrite"]) == 1
    assert len(table.read_text().splitlines()) == rows + 1, "only what is gone is made again"
    assert (output / pages[0] / "report.html").exists()
