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
