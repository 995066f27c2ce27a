"""Rows of the table that `make bench` prints at its end."""

from __future__ import annotations

import os
from pathlib import Path

TABLE = "TWBR_BENCH_TABLE"
"""Environment variable with the file that collects the rows."""


def row(measure: str, found: str, required: str) -> None:
    """Print one measure with what was found and what is required, and keep it for the table."""
    line = f"| {measure} | {found} | {required} |"
    print(line, flush=True)
    if target := os.environ.get(TABLE):
        with Path(target).open("a", encoding="utf-8") as file:
            file.write(f"{line}\n")
