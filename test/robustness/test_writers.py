"""What writes is killed at each of its steps, and its disk is full at every stage."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from reliability.file_faults import library
from reliability.set_clock import compiler
from reliability.writer_trials import tried

pytestmark = pytest.mark.skipif(compiler() is None, reason="needs a C compiler")
KILLS = 24


@pytest.mark.parametrize("name", ["urdf --overwrite", "~/calibrate"])
def test_it_leaves_the_old_or_the_new_and_says_why(name: str) -> None:
    with TemporaryDirectory() as made:
        folder = Path(made).resolve()
        built = library(folder)
        assert built is not None
        place = folder / "writer"
        place.mkdir()
        found = tried(name, place, built, KILLS, 71)
    assert found["kills"] == KILLS and found["ended"] < KILLS
    assert found["faults"] >= 5 and found["went on"] == found["hung"] == 0
    wrong = ("broken", "left over", "broken on a full disk", "left at once", "bad message")
    assert {each: found[each] for each in wrong} == dict.fromkeys(wrong, 0)
