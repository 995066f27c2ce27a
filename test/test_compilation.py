from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import twbr_estimation
from twbr_estimation.compilation import compiled

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
    loops = {file.name.partition("-")[0] for file in package.rglob("kernels.gyro.*.nb[ci]")}
    assert len(loops) == 1, "the cache keeps a version of the loop that nobody reads"


def test_without_a_place_for_the_cache_it_compiles_all_the_same() -> None:
    space: dict[str, Any] = {}
    exec("def twice(x):\n    return 2.0 * x\ndef run(x):\n    return twice(x)\n", space)  # no file
    assert compiled(space["run"], "0", space["twice"])(3.0) == 6.0
