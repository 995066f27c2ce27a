"""Pages that must follow the code."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

import pytest

from twbr_estimation.cli.filters import markdown_page
from twbr_estimation.filters import filters

ROOT = Path(__file__).resolve().parent.parent
EQUATIONS = (ROOT / "docs" / "equations.md").read_text()


def test_the_page_of_the_filters_is_up_to_date() -> None:
    page = (ROOT / "docs" / "filters.md").read_text()
    assert page == markdown_page(), "run: twbr filters --markdown > docs/filters.md"


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`(\w+(?:\.\w+)+)`", EQUATIONS))))
def test_everything_the_equations_point_to_exists(name: str) -> None:
    module, _, attribute = f"twbr_estimation.{name}".rpartition(".")
    assert hasattr(import_module(module), attribute)


def test_every_test_the_equations_point_to_exists() -> None:
    sources = "".join(path.read_text() for path in Path(__file__).parent.rglob("test_*.py"))
    named = re.findall(r"`(test_\w+)`", EQUATIONS)
    assert named
    assert all(f"def {name}(" in sources for name in named)


PAPERS = ("Laddach", "Sihite", "Chudzik", "Sun")


@pytest.mark.parametrize(
    "name", [name for name, entry in filters().items() if entry.source.startswith(PAPERS)]
)
def test_the_equations_point_to_every_filter_of_the_papers(name: str) -> None:
    assert f"`filters.{name}.step`" in EQUATIONS


def first_row(page: str, begin: str) -> list[str]:
    """Return the cells of the first row of a table that begins so."""
    lines = (ROOT / page).read_text().splitlines()
    row = next(line for line in lines if line.startswith(f"| {begin}"))
    return [cell.strip(" |*") for cell in row.split(" | ")]


def measured(begin: str, column: int) -> float:
    """Return the number that a cell of docs/accuracy.md begins with."""
    return float(first_row("docs/accuracy.md", begin)[column].split()[0])


FIVE_MS = 3
"""Column of that period in the tables of the worlds."""


@pytest.mark.parametrize(
    ("begin", "ours", "complementary"),
    [
        *(
            (
                f"{name} W{world}",
                [(f"W{world} | ins_odometer", FIVE_MS)],
                [(f"W{world} | complementary", FIVE_MS)],
            )
            for name, world in (("simulated world", 2), ("world", 4))
        ),
        ("BROAD trials", [("BROAD, with wheels, mean", 1)], [("BROAD, with wheels, mean", 2)]),
        (
            "UIUC, slow and medium",
            [("UIUC slow", 1), ("UIUC medium", 1)],
            [("UIUC slow", 2), ("UIUC medium", 2)],
        ),
    ],
)
def test_the_figures_of_the_first_page_are_those_of_the_tables(
    begin: str, ours: list[tuple[str, int]], complementary: list[tuple[str, int]]
) -> None:
    for cell, sources in zip(first_row("README.md", begin)[1:], (ours, complementary), strict=True):
        shown = [each.strip("* ") for each in cell.split(",")]
        for text, (row, column) in zip(shown, sources, strict=True):
            decimals = len(text.partition(".")[2])
            assert float(text) == round(measured(row, column), decimals)
