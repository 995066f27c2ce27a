"""The campaign's table and its parts."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")

import campaign
from reliability.parts.stamps import faults
from reliability.results import keep, load, page
from reliability.row import Effort, Row

ROOT = Path(__file__).resolve().parents[2]


def test_parts_are_found_by_their_files() -> None:
    names = campaign.part_names()
    assert {"messages", "parameters", "transitions", "stamps", "writers"} <= set(names)
    assert all(campaign.about(campaign.part_named(name)).endswith(".") for name in names)


def test_a_part_replaces_its_own_rows_and_the_page_shows_what_fell_short(tmp_path: Path) -> None:
    kept = tmp_path / "kept.json"
    keep(kept, "b", "About b.", [Row("old", 1, "p", "s", True)])
    keep(kept, "a", "About a.", [Row("x|y", 12_000, "p", "s", False)])
    keep(kept, "b", "About b.", [Row("new", 1, "p", "s", True)])
    found = page(load(kept))
    assert found.index("About a") < found.index("About b")
    assert "old" not in found and "| new | 1 | p | s | held |" in found
    assert "| x\\|y | 12 000 | p | s | **fell short** |" in found


def test_the_page_in_the_documents_is_made_of_its_results() -> None:
    kept = load(ROOT / "docs" / "reliability.json")
    assert kept and page(kept) == (ROOT / "docs" / "reliability.md").read_text()


def test_tries_are_a_share_of_the_full_number_and_never_none() -> None:
    assert [Effort(scale).tries(200) for scale in (1.0, 0.1, 1e-6)] == [200, 20, 1]


@pytest.mark.parametrize("fault", ["stamps 0.1 s back for 1 s, then right again", "0.3 s lost"])
def test_stamps_that_jump_leave_nothing_wrong_and_valid(fault: str) -> None:
    from reliability.parts.stamps import _one

    wrong, late, raised = _one("complementary", faults()[fault], 71)
    assert wrong <= 0.001 and late <= 3.0 and raised == 0
