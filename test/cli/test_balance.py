"""`twbr balance` as a user meets it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from twbr_estimation.cli.main import main

SHORT = ["balance", "--seeds", "2", "--duration", "2", "--jobs", "1"]


def balanced(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict:
    assert main([*SHORT, *arguments, "--json", "-"]) == 0
    return json.loads(capsys.readouterr().out)


def test_table_and_json_say_the_same(capsys, tmp_path):
    target = tmp_path / "balance.json"
    chosen = ["--estimator", "truth", "--estimator", "complementary", "--controller", "pid"]
    assert main([*SHORT, *chosen, "--json", str(target)]) == 0
    shown = capsys.readouterr().out
    assert "world paper, controller pid" in shown
    document = json.loads(target.read_text())
    assert len(document["runs"]) == 4
    for entry in document["standings"]:
        assert f"{entry['estimator']} " in shown
        assert f"{100.0 * entry['mean']['upright']:.1f}" in shown
        assert entry["seeds"] == 2


def test_worlds_controllers_and_seeds_multiply(capsys):
    document = balanced(
        capsys, "--estimator", "truth", "--world", "ideal", "--world", "W4",
        "--controller", "pid", "--controller", "slc_sihite2018", "--first-seed", "7",
    )  # fmt: skip
    runs = {(run["world"], run["controller"], run["seed"]) for run in document["runs"]}
    assert runs == {
        (world, name, seed)
        for world in ("ideal", "W4")
        for name in ("pid", "slc_sihite2018")
        for seed in (7, 8)
    }


def test_a_preset_and_single_values_count(capsys):
    chosen = ("--estimator", "complementary")
    errors = [
        balanced(capsys, *chosen, *more)["standings"][0]["mean"]["rms_error"]
        for more in ((), ("--preset", "table2"), ("--set", "complementary.time_constant=0.01"))
    ]
    assert len(set(errors)) == 3


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--estimator", "none"], "there is no filter 'none'"),
        (["--controller", "none"], "there is no controller 'none'"),
        (["--world", "none"], "there is no world 'none'"),
        (["--seeds", "0"], "at least one seed"),
        (["--jobs", "0"], "--jobs 0"),
        (["--dt", "0.003"], "not a multiple"),
        (["--set", "pid.tilt_gain=-1"], "pid.tilt_gain"),
        (["--preset", "none"], "there is no preset"),
    ],
)
def test_what_cannot_be_run_is_named(capsys, arguments, said):
    assert main([*SHORT, *arguments]) == 1
    assert said in capsys.readouterr().err


def await_workers(parent: subprocess.Popen[str]) -> None:
    """Return when worker processes begin to start, the worst instant to be interrupted."""
    until = time.monotonic() + 120.0
    while parent.poll() is None and time.monotonic() < until:
        for process in Path("/proc").glob("[0-9]*"):
            try:
                above = process.joinpath("stat").read_text().rpartition(")")[2].split()[1]
                command = process.joinpath("cmdline").read_bytes()
            except OSError:
                continue  # it has ended
            if int(above) == parent.pid and b"forkserver" in command:
                return
        time.sleep(0.01)
    pytest.fail(f"no worker process was started: {parent.communicate()[1]}")


def test_ctrl_c_ends_it_without_a_trace():
    command = [sys.executable, "-m", "twbr_estimation.cli.main", "balance", "--jobs", "2"]
    process = subprocess.Popen(
        [*command, "--estimator", "complementary", "--seeds", "50"],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
        # A shell's background job, as tests may be, ignores Ctrl-C and so do its children.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        text=True,
    )
    await_workers(process)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in errors
