"""Writers of pages and pictures that are killed, and disks that are full.

As the part `writers`, for the commands that draw.
"""

from __future__ import annotations

from collections.abc import Iterator

from reliability.parts.writers import rows_of
from reliability.row import Effort, Row
from reliability.writers import PAGES


def rows(effort: Effort) -> Iterator[Row]:
    """Try every writer of pages.

    Raises:
        Skipped: there is no C compiler.
    """
    yield from rows_of(effort, PAGES)
