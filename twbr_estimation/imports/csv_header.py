"""The header of a log: where it is, and which of its names a description means."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ..errors import RecordingError

_UNIT = re.compile(r"\s*[\[(].*[\])]\s*$")
_LONGEST_PREAMBLE = 100
"""Rows in which a header is looked for."""


def place_of(name: str, names: Sequence[str]) -> int | None:
    """Return where a header has a name; None where it has not.

    A name that differs in capitals, or by a unit in brackets behind it, is meant where it is the
    only one.

    Raises:
        RecordingError: several columns have this name.
    """
    plain = _plain(name)
    found = [place for place, each in enumerate(names) if each.strip() == name.strip()]
    found = found or [place for place, each in enumerate(names) if _plain(each) == plain]
    if len(found) > 1:
        where = ", ".join(map(str, found))
        raise RecordingError(f"columns {where} are all named {name!r}; give the number of one")
    return found[0] if found else None


def header_row(rows: Sequence[Sequence[str]], wanted: Sequence[str]) -> int | None:
    """Return the row of the header.

    Args:
        rows: Fields of all rows; lines before the header are a preamble.
        wanted: Names that the description asks for.

    Returns:
        The first row with all of these names. Without names, the first row, or None where its
        fields are numbers: the log has no header. The first row, too, where names are missing.
    """
    if not wanted:
        return None if rows and all(map(is_number, rows[0])) else 0
    plain = {_plain(name) for name in wanted}
    for number, row in enumerate(rows[:_LONGEST_PREAMBLE]):
        if plain <= set(map(_plain, row)):
            return number
    return 0


def _plain(name: str) -> str:
    return _UNIT.sub("", name).strip().lower()


def is_number(field: str) -> bool:
    """Whether a field is a number, or empty."""
    try:
        float(field or "0")
    except ValueError:
        return False
    return True
