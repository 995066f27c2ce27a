"""Adapters of other projects' estimators."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from twbr_estimation.bags import write_recording
from twbr_estimation.cli.main import main
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.peers.base import Inertial, Peer, level_attitude
from twbr_estimation.peers.comparison import BLIND, OURS, PEERS, chosen, compare, peer_tilt
from twbr_estimation.peers.table import errors_by_group, markdown
from twbr_estimation.ros_messages import tilt_of_quaternion
from twbr_estimation.samples import STANDARD_GRAVITY
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.simulate import Simulated

PERIOD = 0.01
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def simulated() -> Simulated:
    return simulate("paper", PERIOD, 4.0, 3)


def swing() -> tuple[Inertial, np.ndarray]:
    """Return the samples of a slow swing about all axes, free of errors, and its tilt."""
    time = np.arange(0.0, 20.0, PERIOD)
    tilt, roll = 0.4 * np.sin(0.9 * time), 0.15 * np.sin(0.7 * time)
    up = np.stack([-np.sin(tilt) * np.cos(roll), np.sin(roll), np.cos(tilt) * np.cos(roll)], 1)
    rolling = np.gradient(roll, PERIOD)
    rate = np.stack(
        [rolling * np.cos(tilt), np.gradient(tilt, PERIOD), rolling * np.sin(tilt)], axis=1
    )
    return Inertial(rate, STANDARD_GRAVITY * up, PERIOD), tilt


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
def test_a_peer_follows_a_clean_swing_in_our_sign(peer: Peer) -> None:
    if peer.package == "attipy" and "NUMBA_DISABLE_JIT" not in os.environ:
        again_without_compiler(peer.name)  # it compiles for a minute, and keeps nothing
        return
    samples, tilt = swing()
    try:
        error = np.degrees(peer_tilt(peer, samples) - tilt)
    except ImportError:
        pytest.skip(f"{peer.package} is not installed: extra `peers`")
    assert np.abs(error[200:]).max() < 2.5  # its amplitude is 23 deg


def again_without_compiler(name: str) -> None:
    pytest.importorskip("attipy", reason="attipy is not installed: extra `peers`")
    command = [sys.executable, "-m", "pytest", "-q", __file__, "-k", f"clean_swing and {name}"]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    result = subprocess.run(
        command, env=environment, capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert result.returncode == 0, result.stdout[-2000:]
    assert "1 passed" in result.stdout


@pytest.mark.parametrize("tilt", [-3.0, -1.2, 0.0, 0.4, 2.5])
def test_the_first_force_gives_the_attitude(tilt: float) -> None:
    force = 9.0 * np.array([-math.sin(tilt), 0.0, math.cos(tilt)])
    w, x, y, z = level_attitude(force)
    assert float(tilt_of_quaternion(x, y, z, w)) == pytest.approx(tilt)
    assert math.hypot(w, x, y, z) == pytest.approx(1.0)


def test_our_filters_run_with_and_without_wheels(simulated: Simulated) -> None:
    found = compare(simulated.drive, ())
    assert set(found.score.estimators) == {name + end for name in OURS for end in ("", BLIND)}
    assert set(found.microseconds) == set(found.score.estimators)
    assert found.missing == ()


def test_a_missing_peer_is_named_and_left_out(
    simulated: Simulated, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "vqf", None)
    found = compare(simulated.drive, chosen(["vqf"]), ("complementary",))
    assert found.missing == ("VQF 3 s: pip install vqf", "VQF 6 s: pip install vqf")
    assert set(found.score.estimators) == {"complementary", "complementary" + BLIND}


def test_an_unknown_peer_is_named() -> None:
    with pytest.raises(ConfigurationError, match=r"no peer 'madgwick'; there are: vqf, VQF 3 s"):
        chosen(["madgwick"])
    assert [peer.name for peer in chosen(["ahrs EKF", "riann"])] == ["RIANN", "ahrs EKF"]


def test_the_best_of_a_row_is_bold(simulated: Simulated) -> None:
    found = compare(simulated.drive, (), ("complementary", "kalman"))
    errors = errors_by_group({"paper": [found, found]})["paper"]
    best = min(errors, key=errors.__getitem__)
    head, _, row, cost = markdown({"paper": [found, found]}).splitlines()
    assert row.split(" | ")[head.split(" | ").index(best)] == f"**{errors[best]:.3g}**"
    assert row.count("**") == 2 and cost.startswith("| us a sample | ")


def test_the_command_prints_and_writes_the_same(
    simulated: Simulated, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag, target = tmp_path / "bag", tmp_path / "peers.json"
    write_recording(bag, simulated.recording)
    arguments = ["peers", str(bag), "--filter", "complementary", "--peer", "vqf"]
    assert main([*arguments, "--json", str(target)]) == 0
    shown = capsys.readouterr().out
    (found,) = json.loads(target.read_text())["recordings"]
    assert "complementary" + BLIND in found["estimators"]
    for name, each in found["estimators"].items():
        assert name in shown and f"{each['mse_deg2']:.4f}" in shown
    assert ("VQF 3 s" in found["estimators"]) is not bool(found["missing"])
    assert main(["peers", str(bag), "--peer", "madgwick"]) == 1
    assert "there is no peer 'madgwick'" in capsys.readouterr().err
