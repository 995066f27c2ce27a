"""Writers of figures that are killed, and disks that are full.

As the part `writers`, for the commands that compute figures of recordings and write them.
"""

from __future__ import annotations

from collections.abc import Iterator

from reliability.parts.writers import rows_of
from reliability.row import Effort, Row
from reliability.writers import FIGURES


def rows(effort: Effort) -> Iterator[Row]:
    """Try every writer of figures.

    Raises:
        Skipped: there is no C compiler.
    """
    yield from rows_of(effort, FIGURES)
