"""The page about nodes and topics must follow the nodes."""

from __future__ import annotations

import importlib.util
from array import array
from pathlib import Path
from types import ModuleType
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


def topics_page() -> ModuleType:
    specification = importlib.util.spec_from_file_location(
        "topics_page", ROOT / "tools" / "topics_page.py"
    )
    assert specification is not None and specification.loader is not None
    tool = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(tool)
    return tool


def test_the_page_of_the_topics_is_up_to_date(graph: Any) -> None:
    page = (ROOT / "docs" / "topics.md").read_text()
    assert page == topics_page().page(graph.context), (
        "run: python tools/topics_page.py > docs/topics.md"
    )


def test_every_parameter_has_a_description_and_every_number_limits(graph: Any) -> None:
    tool = topics_page()
    kinds = [kind for module in tool.node_modules() for kind in tool.node_kinds(module)]
    assert len(kinds) >= 7
    for kind in kinds:
        node = tool.plain_node(kind, graph.context)
        for name in tool.parameter_names(node):
            descriptor, value = node.describe_parameter(name), node.get_parameter(name).value
            where = f"{node.get_name()}: {name}"
            assert descriptor.description, where
            elements = value if isinstance(value, (array, list)) else [value]
            if any(type(each) in (int, float) for each in elements):
                assert tool.limits(descriptor), where
        node.destroy_node()
