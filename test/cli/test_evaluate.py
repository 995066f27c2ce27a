"""`twbr evaluate` as a user meets it: table, JSON, presets, configuration, errors."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import twbr_estimation as twbr
from twbr_estimation.bags import write_recording
from twbr_estimation.cli.main import main
from twbr_estimation.configuration.files import write_section
from twbr_estimation.filters import listed_filters
from twbr_estimation.printing.console import SafeConsole
from twbr_estimation.recording import TiltTrack
from twbr_estimation.robot import Calibration, Robot
from twbr_estimation.scoring.score import RecordingScore, Score
from twbr_estimation.scoring.table import print_many_scores
from twbr_estimation.simulation import simulate


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two short recordings of the paper's robot; the first describes its robot."""
    folder = tmp_path_factory.mktemp("bags")
    paths = folder / "first", folder / "second"
    for seed, path in enumerate(paths, start=31):
        simulated = simulate("paper", 0.002, 8.0, seed)
        dmp = TiltTrack(simulated.recording.imu.stamps, np.full(4000, 0.05))
        write_recording(path, replace(simulated.recording, estimators={"dmp": dmp}))
    (paths[0] / "config").mkdir()
    write_section(paths[0] / "config" / "robot.yaml", simulated.setup.robot)
    write_section(paths[0] / "config" / "calibration.yaml", simulated.setup.calibration)
    return paths


def evaluated(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict:
    """Run `twbr evaluate ... --json -` and return its JSON."""
    assert main(["evaluate", *map(str, arguments), "--json", "-"]) == 0
    return json.loads(capsys.readouterr().out)


def test_all_filters_in_table_and_json(bags, capsys, tmp_path):
    target = tmp_path / "figures.json"
    assert main(["evaluate", *map(str, bags), "--json", str(target)]) == 0
    printed = capsys.readouterr().out
    document = json.loads(target.read_text())
    assert set(document) == {"recordings", "mean"}
    assert [entry["source"] for entry in document["recordings"]] == [str(bag) for bag in bags]
    for entry in document["recordings"]:
        assert entry["dt"] == pytest.approx(0.002)
        assert entry["samples"] == 4000
        assert set(entry["estimators"]) == set(listed_filters())
    for name in listed_filters():
        assert name in printed
        both = [entry["estimators"][name]["mse_deg2"] for entry in document["recordings"]]
        assert document["mean"][name]["mse_deg2"] == pytest.approx(np.mean(both))
    assert "[deg²]" in printed
    assert "mean over 2 recordings" in printed


def test_recording_s_own_configuration_is_used_unless_another_is_given(bags, capsys, tmp_path):
    own = evaluated(capsys, bags[0], "--filter", "gyro")["mean"]["gyro"]["mse_deg2"]
    none = evaluated(capsys, bags[1], "--filter", "gyro")["mean"]["gyro"]["mse_deg2"]
    write_section(tmp_path / "robot.yaml", Robot())
    write_section(tmp_path / "calibration.yaml", Calibration())
    given = evaluated(capsys, bags[0], "--filter", "gyro", "--config", tmp_path)
    assert own < 5.0 < none
    assert given["mean"]["gyro"]["mse_deg2"] > 5.0


def test_preset_and_single_values_change_the_result(bags, capsys):
    def mse(*arguments: str) -> float:
        chosen = evaluated(capsys, bags[0], "--filter", "complementary", *arguments)
        return chosen["mean"]["complementary"]["mse_deg2"]

    preset = mse("--preset", "table2")
    assert preset != mse("--set", "complementary.time_constant=0.05")
    assert preset == mse("--preset", "table2", "--set", "complementary.time_constant=1.06895")


@pytest.fixture
def backward(bags, tmp_path) -> Path:
    """The first recording with wheels that run backward, and its robot."""
    recording = twbr.load(bags[0]).recording
    wheels = replace(recording.wheels, angle=-recording.wheels.angle)
    path = tmp_path / "backward"
    write_recording(path, replace(recording, wheels=wheels))
    (path / "config").symlink_to(bags[0] / "config")
    return path


def test_findings_stand_before_the_figures(bags, backward, capsys):
    assert main(["evaluate", str(backward), str(bags[0]), "--filter", "kalman"]) == 0
    printed = capsys.readouterr().out
    brief, figures = printed.index("FAIL wheels: "), printed.index("┃ estimator")
    assert printed.startswith(f"{backward}: the data have ")
    assert brief < figures < printed.index("warning: wheels: ")
    assert printed.count("FAIL wheels: ") == 1  # not for the recording that has none


def test_json_has_the_findings_as_the_check_does(backward, capsys):
    (entry,) = evaluated(capsys, backward, "--filter", "kalman")["recordings"]
    (failed,) = (each for each in entry["findings"] if each["severity"] == "FAIL")
    assert failed["subject"] == "wheels"
    assert failed["parameter"] == "signs"
    assert f"wheels: {failed['text']}" in entry["warnings"]


def test_many_recordings_have_the_same_findings(backward, capsys, tmp_path):
    results = ["--results", str(tmp_path / "results.jsonl"), "--jobs", "1"]
    (one,) = evaluated(capsys, backward, "--filter", "kalman")["recordings"]
    for _ in range(2):  # computed, then read from the table
        (many,) = evaluated(capsys, backward, "--filter", "kalman", *results)["recordings"]
        assert many["findings"] == one["findings"]
        assert many["warnings"] == one["warnings"]


def test_of_many_recordings_each_kind_of_finding_is_counted(capsys):
    finding = {"severity": "FAIL", "subject": "wheels", "check": "sign", "text": "backward"}
    score = Score(1.0, 1.0, 0.0, 1.0, 0.0, 10, 0)
    scores = [
        RecordingScore(f"bag{n}", 0.002, 10, {"kalman": score}, findings=[finding] * (n < 7))
        for n in range(21)
    ]
    print_many_scores(SafeConsole(), scores)
    assert capsys.readouterr().out.startswith("FAIL wheels, sign: in 7 of 21 recordings\n")


def test_terms_of_the_correction_can_be_switched_off(bags, capsys):
    def mse(*arguments: str) -> float:
        chosen = evaluated(capsys, bags[0], "--filter", "accelerometer", *arguments)
        return chosen["mean"]["accelerometer"]["mse_deg2"]

    assert mse() == mse("--terms", "euler,centrifugal,wheel")
    assert mse() != mse("--terms", "none")
    assert mse("--terms", "wheel") not in (mse(), mse("--terms", "none"))


def test_another_estimator_in_the_recording_joins(bags, capsys):
    document = evaluated(
        capsys, bags[0], "--filter", "complementary", "--estimator", "chip=/imu/dmp"
    )
    assert set(document["mean"]) == {"complementary", "chip"}
    chip = document["mean"]["chip"]
    assert chip["max_abs_deg"] > 1.0
    lifted = evaluated(
        capsys, bags[0], "--filter", "complementary", "--estimator", "chip=/imu/dmp,offset_deg=2.5"
    )["mean"]["chip"]
    assert lifted["bias_deg"] == pytest.approx(chip["bias_deg"] + 2.5)


def test_reference_options_and_skip(bags, capsys):
    def figures(*arguments: str) -> dict:
        chosen = evaluated(capsys, bags[0], "--filter", "complementary", *arguments)
        return chosen["recordings"][0]["estimators"]["complementary"]

    plain = figures()
    assert figures("--reference-offset", "1.5")["bias_deg"] == pytest.approx(
        plain["bias_deg"] - 1.5, abs=1e-6
    )
    delayed = figures("--reference-delay", "0.05")
    assert delayed["delay_s"] == pytest.approx(plain["delay_s"] - 0.05, abs=0.01)
    assert figures("--skip", "3")["samples"] == plain["samples"] - 1500


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--filter", "unheard_of"], "there is no filter 'unheard_of'; there are: accelerometer"),
        (["--preset", "unheard_of"], "there is no preset 'unheard_of'"),
        (["--set", "complementary.time_constant=-3"], "-3.0 is outside [0.001, 1000] s"),
        (["--set", "complementary"], "expected FILTER.PARAMETER=VALUE"),
        (["--terms", "gravity"], "there are euler, centrifugal, wheel, yaw, none"),
        (["--config", "/nowhere/at/all"], "/nowhere/at/all: there is no such"),
        (["--reference-topic", "/nothing"], "/nothing"),
        (["--skip", "1000"], "no sample is left to compare; check the skipped time"),
        (["--skip", "-1"], "--skip -1: must be 0 s or more"),
        (["--reference-delay", "1000"], "do not overlap"),
        (["--set", "unheard_of.gain=1"], "--set: unheard_of is no filter"),
        (["--filter", "gyro", "--set", "kalman.r=1"], "kalman has values but does not run"),
        (["--estimator", "kalman=/imu/dmp"], "estimator kalman: this is a filter's name"),
        (["--estimator", "a=/b", "--estimator", "a=/c"], "--estimator a=/c: a is /b already"),
        (["--wheel-joints", "a,b,c"], "--wheel-joints"),
        (["--estimator", "chip=/nothing"], "/nothing"),
        (["--json", "/proc/at/all.json"], "/proc/at"),
    ],
)
def test_errors_say_what_was_wrong(bags, capsys, arguments, message):
    assert main(["evaluate", str(bags[0]), *arguments]) == 1
    assert message in " ".join(capsys.readouterr().err.split())


def test_warns_of_another_sampling_period_and_of_eigenvalues(bags, capsys):
    assert main(["evaluate", str(bags[0]), "--filter", "alpha_beta_theta_wa_a"]) == 0
    assert "eigenvalue of A - KCA" in capsys.readouterr().out


def test_a_diverging_filter_is_left_out_and_said(bags, capsys):
    wild = [f"--set=alpha_beta_classic.{value}" for value in ("alpha=1", "beta=4")]
    chosen = ("--filter", "alpha_beta_classic", "--filter", "gyro")
    document = evaluated(capsys, bags[0], *chosen, *wild)
    assert set(document["mean"]) == {"gyro"}
    (warning,) = [text for text in document["recordings"][0]["warnings"] if "diverges" in text]
    assert warning.startswith("alpha_beta_classic: diverges; it is no angle from")
    assert main(["evaluate", str(bags[0]), "--filter", "alpha_beta_classic", *wild]) == 1
    assert "alpha_beta_classic: diverges" in capsys.readouterr().err


def test_an_unstable_low_pass_is_refused(bags, capsys, tmp_path):
    (tmp_path / "filters.yaml").write_text(
        "/**: {ros__parameters: {correction: {rate_time_constant: -0.001}}}"
    )
    assert main(["evaluate", str(bags[0]), "--config", str(tmp_path)]) == 1
    assert "must be above -0.001 s" in " ".join(capsys.readouterr().err.split())


def test_says_that_the_robot_is_unknown_where_nothing_describes_it(bags, capsys, tmp_path):
    def unknown(*arguments: object) -> bool:
        entry = evaluated(capsys, "--filter", "gyro", *arguments)["recordings"][0]
        return any("no robot is described" in text for text in entry["warnings"])

    write_section(tmp_path / "robot.yaml", Robot())
    assert unknown(bags[1])
    assert not unknown(bags[1], "--config", tmp_path)
    assert not unknown(bags[0])


def test_a_slower_loop_combines_the_samples(bags, capsys):
    names = ("--filter", "complementary")
    each = evaluated(capsys, bags[0], *names)["recordings"][0]["estimators"]["complementary"]
    slow = evaluated(capsys, bags[0], *names, "--loop-period", "0.02")
    combined = slow["recordings"][0]["estimators"]["complementary"]
    assert combined["samples"] == pytest.approx(each["samples"] / 10, abs=1)
    assert combined["mse_deg2"] < 3.0 * each["mse_deg2"]
    assert main(["evaluate", str(bags[0]), "--loop-period", "-1"]) == 1
    assert "--loop-period: -1.0 is no number from 0 to 1 s" in capsys.readouterr().err


@pytest.fixture(scope="module")
def without_encoder(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """One drive twice, with the robot's description: without and with reference encoder."""
    simulated = simulate("W1", 0.005, 20.0, 6111)
    folder = tmp_path_factory.mktemp("smooth")
    for name, recording in (
        ("without", replace(simulated.recording, reference=None, truth=None)),
        ("with", simulated.recording),
    ):
        write_recording(folder / name, recording)
        (folder / name / "config").mkdir()
        write_section(folder / name / "config" / "robot.yaml", simulated.setup.robot)
        write_section(folder / name / "config" / "calibration.yaml", simulated.setup.calibration)
    return folder / "without", folder / "with"


def test_smoothing_takes_the_place_of_the_encoder(without_encoder, capsys, tmp_path):
    without, encoder = without_encoder
    choice = ("--filter", "complementary", "--filter", "ins_odometer", "--smooth")
    target = tmp_path / "figures.json"
    saved = tmp_path / "saved"
    arguments = [str(without), *choice, "--json", str(target), "--save-reference", str(saved)]
    assert main(["evaluate", *arguments]) == 0
    assert "reference: smoothed from the recording itself" in capsys.readouterr().out
    (own,) = json.loads(target.read_text())["recordings"]
    (true,) = evaluated(capsys, encoder, *choice)["recordings"]
    assert own["reference"] == "smoothed"
    assert true["reference"] == "encoder"
    assert set(own["estimators"]) == {"complementary", "ins_odometer"}
    assert set(true["estimators"]) == {"complementary", "ins_odometer", "smoothed"}
    mse = true["estimators"]["smoothed"]["mse_deg2"]
    assert mse < true["estimators"]["ins_odometer"]["mse_deg2"] < 0.2
    assert own["smoothed_deviation_deg"] == true["smoothed_deviation_deg"]
    assert 0.45 < own["smoothed_deviation_deg"] < 0.57  # 0.45 of it is the mounting
    ours = own["estimators"]["complementary"]["mse_deg2"]
    assert ours == pytest.approx(true["estimators"]["complementary"]["mse_deg2"], rel=0.25)

    again = evaluated(capsys, saved, "--filter", "complementary")
    (entry,) = again["recordings"]
    assert entry["reference"] == "encoder"
    assert entry["estimators"]["complementary"]["mse_deg2"] == pytest.approx(ours, rel=1e-6)


def test_saving_a_reference_is_refused_where_it_makes_no_sense(without_encoder, capsys, tmp_path):
    without, encoder = map(str, without_encoder)
    new = str(tmp_path / "new")
    for arguments, message in (
        ([without, "--save-reference", new], "needs --smooth and a single recording"),
        ([without, without, "--smooth", "--save-reference", new], "a single recording"),
        ([without, "--smooth", "--save-reference", str(tmp_path)], "exists already"),
        ([encoder, "--smooth", "--save-reference", new], "has a reference of its own"),
    ):
        assert main(["evaluate", *arguments, "--filter", "gyro"]) == 1
        assert message in " ".join(capsys.readouterr().err.split())
        assert not Path(new).exists()
