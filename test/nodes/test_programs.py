"""Every node is a program: by its command, and by `python -m` with its module."""

from __future__ import annotations

import ast
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from twbr_estimation import nodes

NODES = sorted(Path(str(nodes.__file__)).parent.glob("*_node.py"))
LAUNCHER = Path(__file__).resolve().parents[2] / "scripts" / "run_node"
IMPORTS = "import twbr_estimation.nodes.filter_node\nfrom twbr_estimation.nodes import commands\n"
STATE = """
import gc, os, signal
print(gc.get_threshold()[0], [name for name in os.environ if name.endswith("NUM_THREADS")],
      signal.getsignal(signal.SIGINT) == signal.default_int_handler, flush=True)
"""
WITHOUT_THREADS = {key: os.environ[key] for key in os.environ if not key.endswith("NUM_THREADS")}


@pytest.mark.parametrize("path", NODES, ids=lambda path: path.stem)
def test_a_module_that_is_run_runs_its_node(path: Path) -> None:
    last = ast.parse(path.read_text()).body[-1]
    assert ast.unparse(last) == "if __name__ == '__main__':\n    raise SystemExit(main())"


@pytest.mark.parametrize(
    "name", ["motor_node", "filter_node", "-c", "robot.py /data/left_node", "-m motor_node"]
)
def test_a_user_s_process_that_imports_nodes_stays_as_it_is(tmp_path: Path, name: str) -> None:
    program, *arguments = name.split()
    code = f"{STATE}{IMPORTS}{STATE}# twbr_estimation.nodes.filter_node"
    if program == "-c":
        arguments = [code]
    for file in (program, "motor_node.py"):
        (tmp_path / file).write_text(code)
    done = subprocess.run(
        [sys.executable, program, *arguments],
        cwd=tmp_path, env=WITHOUT_THREADS, capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    before, after = done.stdout.splitlines()
    assert after == before


@pytest.mark.parametrize("way", ["launcher", "module"])
@pytest.mark.parametrize(
    ("threads", "said"),
    [({}, "['OPENBLAS_NUM_THREADS']"), ({"OMP_NUM_THREADS": "2"}, "['OMP_NUM_THREADS']")],
)
def test_a_command_starts_quickly_and_is_interrupted_without_a_traceback(
    tmp_path: Path, way: str, threads: dict[str, str], said: str
) -> None:
    """Numpy is one that shows how its process is, and takes a minute to import."""
    (tmp_path / "numpy.py").write_text(f"{STATE}\nimport time; time.sleep(60)")
    (tmp_path / "python3").symlink_to(sys.executable)
    command = [sys.executable, "-m", "twbr_estimation.nodes.filter_node", "--ros-args"]
    if way == "launcher":
        installed = shutil.copy(LAUNCHER, tmp_path / "filter_node")
        command = [str(installed), "--ros-args"]
    packages = [str(tmp_path), *filter(None, sys.path)]
    environment = WITHOUT_THREADS | threads | {
        "PATH": f"{tmp_path}:{os.environ['PATH']}", "PYTHONPATH": os.pathsep.join(packages)
    }  # fmt: skip
    pipe = subprocess.PIPE
    with subprocess.Popen(command, env=environment, stdout=pipe, stderr=pipe, text=True) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == f"200000 {said} False\n"
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == -signal.SIGINT
        assert process.stderr.read() == ""
