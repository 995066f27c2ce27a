"""What writes is killed at each of its steps, and its disk is full at every stage."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from reliability.file_faults import library
from reliability.set_clock import compiler
from reliability.writer_trials import tried
from reliability.writers import FIGURES, PAGES, writers

from twbr_estimation.cli.main import parser, verbs

pytestmark = pytest.mark.skipif(compiler() is None, reason="needs a C compiler")
KILLS = 24
WRITING = ("--output", "--json", "--plot", "--markdown", "--results", "--save-reference")
"""Options of commands that take a file or folder to write."""


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


def options(top: argparse.ArgumentParser) -> Iterator[str]:
    """Yield the options with a value, those of sub-commands as well."""
    for action in top._actions:
        if isinstance(action.choices, dict):
            for each in action.choices.values():
                yield from options(each)
        elif action.nargs != 0:
            yield from action.option_strings


def test_every_command_that_writes_files_is_among_them() -> None:
    known = {name.split()[0] for name in writers(Path())}
    for verb in verbs():
        writing = sorted(set(WRITING) & set(options(parser([verb]))))
        assert not writing or verb in known, f"twbr {verb} {writing}"
    assert {*FIGURES, *PAGES} < set(writers(Path()))
