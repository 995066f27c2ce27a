"""Writers that are killed, and disks that are full.

What writes recordings, settings and tables is killed with SIGKILL, half of the times between two
calls of the system and half at random instants, from its first step of writing on. Then its disk is
full at each stage: open, write, fsync, rename, close. Each time the output has to be whole, the old
or the new. The parts `figures` and `pages` do the same with commands that write these.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from reliability.file_faults import library
from reliability.row import Effort, Row, Skipped
from reliability.writer_trials import tried
from reliability.writers import FIGURES, PAGES, writers

KILLS = 200


def rows(effort: Effort) -> Iterator[Row]:
    """Try every writer but those of the parts `figures` and `pages`; errors as `rows_of`."""
    others = {*FIGURES, *PAGES}
    yield from rows_of(effort, [name for name in writers(Path()) if name not in others])


def rows_of(effort: Effort, names: Iterable[str]) -> Iterator[Row]:
    """Try these writers.

    Raises:
        Skipped: there is no C compiler.
    """
    with TemporaryDirectory(prefix="twbr_writers_") as made:
        folder = Path(made).resolve()
        built = library(folder)
        if built is None:
            raise Skipped("a C compiler is needed, to let writing fail at a chosen stage")
        for number, name in enumerate(names):
            place = folder / str(number)
            place.mkdir()
            found = tried(name, place, built, effort.tries(KILLS), effort.seed)
            yield _of_kills(name, found)
            yield _of_full_disks(name, found)


def _of_kills(name: str, found: Counter[str]) -> Row:
    broken, left = found["broken"], found["left over"]
    return Row(
        f"SIGKILL to {name}",
        found["kills"],
        "old or new, no temporary file after the next run",
        f"{broken} broken; {left} temporary files after the next run; {found['ended']} had ended",
        broken == left == 0,
    )


def _of_full_disks(name: str, found: Counter[str]) -> Row:
    wrong = [found[each] for each in ("broken on a full disk", "left at once", "bad message")]
    broken, left, bad = wrong
    without = f"; {found['went on']} did without" if found["went on"] else ""
    return Row(
        f"a full disk under {name}",
        found["faults"],
        "old or new, no temporary file, one message with path and space",
        f"{broken} broken; {left} temporary files; {bad} other messages; {found['hung']} hung"
        f"{without}",
        sum(wrong) + found["hung"] == 0,
    )
