from __future__ import annotations

import math
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import twbr_estimation
from twbr_estimation.compilation import compiled, object_code
from twbr_estimation.filters.base import compiled_as

RUN = """
import numpy as np
from twbr_estimation.batch import CorrectedTrack
from twbr_estimation.batch.running import run_compiled
from twbr_estimation.filters import filter_named
from twbr_estimation.robot import Robot
from twbr_estimation.samples import CorrectedSample
track = CorrectedTrack(np.arange(3), np.full((len(CorrectedSample._fields), 3), 0.1))
for name in {names}:
    entry = filter_named(name)
    print(run_compiled(entry, entry.configure(), track, Robot(), None).tilt[-1])
"""


@pytest.fixture(autouse=True)
def cache_beside_the_sources(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)


def test_a_filter_that_is_gone_leaves_nothing_that_breaks_the_others(tmp_path: Path) -> None:
    """Its compiled loop stays in the cache on disk, which names the filter's module."""
    package = tmp_path / "twbr_estimation"
    shutil.copytree(
        Path(twbr_estimation.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__")
    )

    def run(*names: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", RUN.format(names=names)]
        return subprocess.run(
            command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
        )

    gyro = (package / "filters" / "gyro.py").read_text()
    passing = package / "filters" / "passing.py"
    passing.write_text(gyro.replace('name="gyro"', 'name="passing"'))
    before = run("passing", "gyro")
    assert before.returncode == 0, before.stderr
    passing.unlink()
    after = run("gyro")
    assert after.returncode == 0, after.stderr
    assert after.stdout == before.stdout.splitlines(keepends=True)[1]
    assert len(list(package.rglob("gyro.*.loop"))) == 1, "a loop is kept that is never read"


def test_without_a_place_for_the_cache_it_compiles_all_the_same() -> None:
    space: dict[str, Any] = {}
    exec("def twice(x):\n    return 2.0 * x\ndef run(x):\n    return twice(x)\n", space)  # no file
    assert compiled(space["run"], "0", space["twice"])(3.0) == 6.0


CACHED = """
import sys
from twbr_estimation.compilation import compiled
def twice(x):
    return 2.0 * x
def run(x):
    return twice(x)
loop = compiled(run, "7", twice)
print(loop(3.0), sum(loop.stats.cache_hits.values()))
"""


def damages(files: list[Path]) -> dict[str, Callable[[Path], object]]:
    def flip(path: Path) -> None:
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 16
        path.write_bytes(content)

    def folder(path: Path) -> None:
        path.unlink()
        path.mkdir()

    other = {path: next(each for each in files if each != path) for path in files}
    return {
        "flip": flip,
        "truncate": lambda path: path.write_bytes(path.read_bytes()[:-7]),
        "empty": lambda path: path.write_bytes(b""),
        "zeros": lambda path: path.write_bytes(bytes(500)),
        "other": lambda path: path.write_bytes(other[path].read_bytes()),
        "folder": folder,
    }


def test_a_damaged_or_foreign_cache_is_thrown_away(tmp_path: Path) -> None:
    script = tmp_path / "loop.py"
    script.write_text(CACHED)

    def printed() -> str:
        command = [sys.executable, str(script)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    assert printed() == "6.0 0" and printed() == "6.0 1"
    files = sorted(tmp_path.rglob("*.nb[ci]"))
    assert {file.suffix for file in files} == {".nbi", ".nbc"}
    for name, damage in damages(files).items():
        for path in files:
            damage(path)
            assert printed() == "6.0 0", (name, path.suffix)
    assert printed() == "6.0 1"


def plain(x: float) -> float:
    """More than the compiler would put in place of two calls by itself, whatever the processor."""
    total = 0.0
    for k in range(int(x)):
        for j in range(k):
            total += math.cos(total - j) * math.exp(-total) + math.atan2(x + k, total)
            total += math.sinh(total + k) * math.cosh(j * total) - math.tanh(total * x)
            total -= math.asin(math.sin(x - total)) + math.acos(math.cos(k * total))
            total *= math.log1p(total * total) + math.expm1(-total) * math.atan(total + x)
            if total > 100.0:
                total = math.log(total) + math.sqrt(total) / (1.0 + math.tan(total))
    return total


def looping(x: float) -> float:
    total = 0.0
    for k in range(int(x)):
        for j in range(k):
            total += math.sin(total + j) * math.exp(-total) + math.atan2(total, x + k)
            total += math.sinh(total - k) * math.cosh(j + total) - math.tanh(total + x)
            total -= math.asin(math.sin(x + total)) + math.acos(math.cos(k - total))
            total *= math.log1p(total * total) + math.expm1(-total) * math.atan(total - x)
            if total > 100.0:
                total = math.log(total) + math.sqrt(total) / (1.0 + math.tan(total))
    return total


@compiled_as(looping)
def spelled_twice(x: float) -> float:
    return x


def test_only_what_is_spelled_in_loops_is_a_function_of_the_object_file() -> None:
    def run(row: Any) -> None:
        row[0] = plain(row[0]) + plain(row[1]) + spelled_twice(row[0]) + spelled_twice(row[1])

    code, _ = object_code(run, {"row": "2"})
    symbols = set(re.findall(rb"_ZN\d\w*?(plain|looping)B\d", code))
    functions = set(re.findall(rb"_ZN(?!08NumbaEnv)\w*?(plain|looping)B\d", code))
    assert symbols == {b"plain", b"looping"}
    assert functions == {b"looping"}
