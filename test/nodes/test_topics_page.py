"""The page about nodes and topics must follow the nodes."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_of_the_topics_is_up_to_date(graph: Any) -> None:
    specification = importlib.util.spec_from_file_location(
        "topics_page", ROOT / "tools" / "topics_page.py"
    )
    assert specification is not None and specification.loader is not None
    tool = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(tool)
    page = (ROOT / "docs" / "topics.md").read_text()
    assert page == tool.page(graph.context), "run: python tools/topics_page.py > docs/topics.md"
