"""The table of results: what a cut or a second writer leaves of it."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from twbr_estimation.errors import WritingError
from twbr_estimation.many.results import ResultTable


def row(number: int) -> dict[str, object]:
    return {"key": f"k{number}", "result": {"value": number / 7.0}}


@pytest.mark.parametrize("cut", range(1, 40, 6))
def test_a_torn_last_line_is_dropped_and_the_rest_kept(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "results.jsonl"
    table = ResultTable(path)
    table.append([row(1), row(2)])
    table.close()
    whole = path.read_bytes()
    path.write_bytes(whole[:-cut])
    table = ResultTable(path)
    assert "k1" in table and "k2" not in table
    table.append([row(2)])
    table.close()
    assert path.read_bytes() == whole


def test_figures_come_back_to_the_bit_and_the_latest_row_rules(tmp_path: Path) -> None:
    table = ResultTable(tmp_path / "results.jsonl")
    table.append([row(1), {"key": "", "error": "kept for the reader only"}, row(3)])
    table.append([{"key": "k1", "result": {"value": 0.1 + 0.2}}])
    assert table.row("k1")["result"]["value"] == 0.1 + 0.2
    assert table.row("k3")["result"]["value"] == 3 / 7.0
    assert len(table) == 2 and "" not in table


def test_two_writers_share_a_table(tmp_path: Path) -> None:
    one, other = (ResultTable(tmp_path / "results.jsonl") for _ in range(2))
    one.append([row(1)])
    other.append([row(2)])
    one.append([row(3)])
    assert [key in one for key in ("k1", "k2", "k3")] == [True] * 3
    assert one.row("k2") == row(2)


def test_lines_of_other_programs_are_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    path.write_text("a note\n[1, 2]\n\n" + json.dumps(row(1)) + "\n")
    table = ResultTable(path)
    assert len(table) == 1 and table.row("k1") == row(1)
    table.close()
    assert path.read_text().startswith("a note\n")


def test_a_table_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(WritingError, match="cannot be written"):
        ResultTable(tmp_path / "file" / "results.jsonl")
    with pytest.raises(WritingError, match="no file"):
        ResultTable(Path("/dev/null"))


def test_a_disk_that_is_full_leaves_whole_rows_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = ResultTable(tmp_path / "results.jsonl")
    table.append([row(1)])
    whole = table.path.read_bytes()
    write = os.write
    monkeypatch.setattr(os, "write", lambda file, text: write(file, text[:9]))
    with pytest.raises(WritingError, match="no space left on device"):
        table.append([row(2)])
    assert table.path.read_bytes() == whole and "k2" not in table


def test_a_line_that_nests_without_end_is_no_row(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    path.write_text("[" * 200_000 + "\n" + '{"key": "a", "x": 1}\n')
    table = ResultTable(path)
    assert len(table) == 1 and table.row("a")["x"] == 1
