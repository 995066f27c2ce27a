"""Every node is a program: by its command, and by `python -m` with its module."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from twbr_estimation import nodes

NODES = sorted(Path(str(nodes.__file__)).parent.glob("*_node.py"))


@pytest.mark.parametrize("path", NODES, ids=lambda path: path.stem)
def test_a_module_that_is_run_runs_its_node(path: Path) -> None:
    last = ast.parse(path.read_text()).body[-1]
    assert ast.unparse(last) == "if __name__ == '__main__':\n    raise SystemExit(main())"
