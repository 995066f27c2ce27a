"""The benches: what they import exists, and `make bench` runs them all."""

from __future__ import annotations

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
BENCHES = sorted((ROOT / "bench").glob("*.py"))
RUNNER = ROOT / "tools" / "run_benches.py"


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.stem)
def test_what_a_bench_imports_of_the_package_exists(bench: Path) -> None:
    names = [
        (node.module, alias.name)
        for node in ast.walk(ast.parse(bench.read_text()))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("twbr_estimation")
        for alias in node.names
    ]
    for module, name in names:
        try:
            found = import_module(str(module))
        except ModuleNotFoundError as error:
            if str(error.name).startswith("twbr_estimation"):
                raise
            pytest.skip(f"needs {error.name}")
        assert hasattr(found, name), f"{bench.name}: {module} has no {name}"


def run(folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(RUNNER), str(folder)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


def test_a_bench_without_its_package_is_left_out_and_the_others_run(tmp_path: Path) -> None:
    (tmp_path / "bench_a.py").write_text("import no_such_package_here\n")
    (tmp_path / "bench_b.py").write_text("print('measured')\n")
    (tmp_path / "other.py").write_text("print('no bench')\n")
    result = run(tmp_path)
    assert result.returncode == 0
    assert "measured" in result.stdout and "no bench" not in result.stdout
    assert "left out: bench_a: needs the package no_such_package_here" in result.stdout


@pytest.mark.parametrize(
    "program",
    [
        "raise SystemExit(3)",
        "import twbr_estimation.no_such_module",
        "import shared.missing",
        "1/0",
    ],
)
def test_a_failed_bench_fails_the_whole_after_the_others_ran(tmp_path: Path, program: str) -> None:
    (tmp_path / "shared.py").touch()
    (tmp_path / "bench_a.py").write_text(program)
    (tmp_path / "bench_b.py").write_text("print('measured')\n")
    result = run(tmp_path)
    assert result.returncode == 1
    assert "measured" in result.stdout and "failed: bench_a" in result.stdout


def test_rows_of_all_benches_are_one_table_at_the_end(tmp_path: Path) -> None:
    (tmp_path / "rows.py").write_text((ROOT / "bench" / "rows.py").read_text())
    for name in "ab":
        program = f"from rows import row\nrow('speed of {name}', '3 s', '4 s')\nprint('and more')\n"
        (tmp_path / f"bench_{name}.py").write_text(program)
    result = run(tmp_path)
    assert result.returncode == 0
    table = "| measure | found | required |\n|---|---|---|\n"
    lines = "".join(f"| speed of {name} | 3 s | 4 s |\n" for name in "ab")
    assert result.stdout.endswith(table + lines)
