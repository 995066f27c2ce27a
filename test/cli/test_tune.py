"""`twbr tune` from recordings on disk to a parameter file."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from twbr_estimation.bags import read_recording, write_recording
from twbr_estimation.cli.main import INTERRUPTED, main
from twbr_estimation.cli.simulate import write_simulated
from twbr_estimation.configuration.files import read_correction, read_settings
from twbr_estimation.recording import ImuTrack
from twbr_estimation.simulation import simulate
from twbr_estimation.tuning import tune as tuner

TUNE = ["--filter", "complementary", "--filter", "kalman_tuned", "--jobs", "1"]


@pytest.fixture(scope="session")
def drives(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tree with two drives in `training`, one beside it, and one at another rate."""
    folder = tmp_path_factory.mktemp("drives")
    for name, dt, seed in (
        ("training/a", 0.01, 41),
        ("training/b", 0.01, 42),
        ("other", 0.01, 43),
        ("slow", 0.02, 43),
    ):
        write_simulated(folder / name, simulate("paper", dt, 20.0, seed))
    return folder


def written(path: Path) -> dict[str, Any]:
    parameters: dict[str, Any] = yaml.safe_load(path.read_text())["/**"]["ros__parameters"]
    return parameters


def test_a_tree_of_recordings_becomes_a_parameter_file(
    drives: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    training, other = drives / "training", drives / "other"
    assert main(["tune", str(training), "--verify", str(other), "-o", str(tmp_path), *TUNE]) == 0
    file = tmp_path / "filters.yaml"
    settings, correction = read_settings(file), read_correction(file)
    assert settings.dt == pytest.approx(0.01)
    assert correction is not None and correction.dt == pytest.approx(0.01)
    assert set(settings.values) == {"complementary", "kalman_tuned"}
    assert settings.filter in settings.values
    provenance = written(file)["provenance"]
    assert provenance["training"] == [str(training / "a"), str(training / "b")]
    assert provenance["verification"] == [str(other)]
    assert provenance["interrupted"] is False
    about = provenance["kalman_tuned"]
    assert about["verification_mse_deg2"] > 0.0 and about["training_mse_deg2"] > 0.0
    assert len(about["eigenvalue_moduli"]) == 2
    assert any("r: not identifiable" in text for text in about["warnings"])
    printed = capsys.readouterr().out
    assert "rate time constant" in printed and "kalman_tuned" in printed


def test_figures_are_those_of_evaluate(drives: Path, tmp_path: Path) -> None:
    one, other = drives / "training" / "a", drives / "other"
    config = tmp_path / "config"
    shutil.copytree(other / "config", config)
    assert main(["tune", str(one), "--verify", str(other), "-o", str(config), *TUNE]) == 0
    figures = tmp_path / "figures.json"
    evaluate = ["evaluate", str(other), *TUNE[:4], "--config", str(config)]
    assert main([*evaluate, "--json", str(figures)]) == 0
    mean = json.loads(figures.read_text())["mean"]
    for name in ("complementary", "kalman_tuned"):
        about = written(config / "filters.yaml")["provenance"][name]
        assert about["verification_mse_deg2"] == pytest.approx(mean[name]["mse_deg2"], rel=1e-9)


def test_an_existing_file_stays_without_overwrite(
    drives: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "filters.yaml"
    file.write_text("mine")
    command = ["tune", str(drives / "other"), "-o", str(file), *TUNE]
    assert main(command) == 1
    assert file.read_text() == "mine"
    assert "--overwrite replaces it" in capsys.readouterr().err
    assert main([*command, "--overwrite", "--keep-correction"]) == 0
    output = capsys.readouterr()
    assert "replacing" in output.err
    assert "nothing was verified" in output.out
    assert "correction" not in written(file)["provenance"]


def test_training_on_the_verification_recording_is_refused_under_any_name(
    drives: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part = tmp_path / "renamed"
    recording = read_recording(drives / "training" / "b")
    imu = recording.imu
    cut = ImuTrack(imu.stamps[500:] + 7_000_000, imu.gyro[500:], imu.accel[500:])
    write_recording(part, replace(recording, imu=cut))
    output = str(tmp_path / "f.yaml")
    assert main(["tune", str(drives / "training"), "--verify", str(part), "-o", output]) == 1
    error = capsys.readouterr().err
    assert "renamed: 100 % of its IMU readings are those of the training recording" in error


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["other", "slow"], "slow: sampled every 20 ms"),
        (["other", "--filter", "gyro"], "filter gyro has no parameter to tune"),
        (["other", "--objective", "mae"], "objective 'mae'"),
        (["other", "--jobs", "0"], "at least 1 is needed"),
        (["nowhere"], "there is no such recording"),
    ],
)
def test_what_cannot_be_tuned_is_refused(
    drives: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(drives)
    assert main(["tune", *arguments, "-o", str(tmp_path / "f.yaml")]) == 1
    assert message in capsys.readouterr().err


def test_contradicting_recordings_are_tuned_on_only_if_asked(
    drives: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = drives / "other"
    recording = read_recording(good)
    assert recording.wheels is not None
    backward = replace(recording.wheels, angle=-recording.wheels.angle)
    write_recording(tmp_path / "wrong", replace(recording, wheels=backward))
    shutil.copytree(good / "config", tmp_path / "wrong" / "config")
    file = tmp_path / "f.yaml"
    command = ["tune", str(tmp_path / "wrong"), "-o", str(file), *TUNE[:2], "--keep-correction"]
    assert main(command) == 1 and not file.exists()
    error = capsys.readouterr().err
    assert "wrong: wheels: " in error and "run backward; change `signs`" in error
    assert "--accept-contradictions" in error
    assert main(["tune", str(good), "--verify", *command[1:]]) == 1 and not file.exists()
    capsys.readouterr()
    assert main([*command, "--accept-contradictions", "--jobs", "1"]) == 0
    assert "run backward" in capsys.readouterr().out
    assert any("run backward" in each for each in written(file)["provenance"]["warnings"])


def test_ctrl_c_writes_the_best_so_far_and_says_so(
    drives: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(task: Any, names: Any, workers: Any, report: Any) -> Any:
        def stop(name: str, figure: float, values: Mapping[str, float]) -> None:
            raise KeyboardInterrupt

        return tune_filters(task, names, workers, stop)

    tune_filters = tuner.tune_filters
    monkeypatch.setattr(tuner, "tune_filters", interrupted)
    file = tmp_path / "f.yaml"
    assert main(["tune", str(drives / "other"), "-o", str(file), *TUNE]) == INTERRUPTED
    provenance = written(file)["provenance"]
    assert provenance["interrupted"] is True
    assert provenance["complementary"]["interrupted"] is True
    assert set(read_settings(file).values) == {"complementary"}


def test_a_smoothed_reference_tunes_like_the_encoder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive = simulate("W1", 0.01, 30.0, 6121)
    write_simulated(tmp_path / "with", drive)
    bare = replace(drive, recording=replace(drive.recording, reference=None, truth=None))
    write_simulated(tmp_path / "without", bare)
    tuned = {}
    for name, extra in (("with", []), ("without", ["--smooth"])):
        target = tmp_path / f"{name}.yaml"
        arguments = ["--keep-correction", "--filter", "complementary", "--jobs", "1", *extra]
        assert main(["tune", str(tmp_path / name), "-o", str(target), *arguments]) == 0
        tuned[name] = read_settings(target).values["complementary"]["time_constant"]
    assert tuned["without"] == pytest.approx(tuned["with"], rel=0.1)
    capsys.readouterr()
    assert main(["tune", str(tmp_path / "without"), "-o", str(tmp_path / "no.yaml"), *TUNE]) == 1
    assert "there is no topic '/reference/joint_states'" in capsys.readouterr().err
