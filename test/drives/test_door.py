"""`import twbr_estimation as twbr`: what a person at a prompt or in a notebook meets."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import twbr_estimation as twbr
from twbr_estimation.bags import write_recording
from twbr_estimation.batch import correct, run_filter
from twbr_estimation.cli.main import main
from twbr_estimation.cli.simulate import write_simulated
from twbr_estimation.filters import filter_named
from twbr_estimation.pipeline.correction import Corrector
from twbr_estimation.pipeline.pairing import pair, wheel_reading
from twbr_estimation.robot import EncoderPlacement
from twbr_estimation.samples import Sample
from twbr_estimation.simulation import simulate
from twbr_estimation.streams.correction import CorrectionStream
from twbr_estimation.streams.filter_configuration import FilterConfiguration, FilterSettings
from twbr_estimation.streams.filtering import FilterStream

NAMES = ("complementary", "ins_odometer")


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of four seconds with its robot's description."""
    path = tmp_path_factory.mktemp("door") / "bag"
    write_simulated(path, simulate("W2", 0.01, 4.0, 11))
    return path


@pytest.fixture(scope="module")
def drive(bag: Path) -> twbr.Drive:
    return twbr.load(str(bag))


@pytest.fixture(scope="module")
def runs(drive: twbr.Drive) -> twbr.Runs:
    return drive.run(*NAMES)


def test_every_public_name_is_there_and_completed() -> None:
    for name in twbr.__all__:
        assert getattr(twbr, name) is not None
    assert set(twbr.__all__) <= set(dir(twbr))
    with pytest.raises(AttributeError, match="no_such_name"):
        twbr.no_such_name  # noqa: B018


def test_what_holds_arrays_is_shown_in_a_line(drive: twbr.Drive, runs: twbr.Runs) -> None:
    recording = drive.recording
    held = (
        recording.imu,
        recording.wheels,
        recording.truth,
        drive.corrected,
        runs["complementary"],
    )
    for each in (drive, recording, runs, *held):
        assert len(repr(each)) < 200 and "\n" not in repr(each)
    assert repr(drive).endswith(": 400 samples at 10 ms, with wheels, reference, truth>")


def test_filters_is_the_registry_and_the_folder() -> None:
    import twbr_estimation.filters as folder

    assert twbr.filters() == folder.listed_filters()
    assert twbr.filters()["kalman"] is folder.filter_named("kalman")


def test_a_recording_loads_from_text_and_path_alike(bag: Path, drive: twbr.Drive) -> None:
    again = twbr.load(bag)
    assert again.key == drive.key
    assert again.setup == twbr.read_setup(bag / "config") != twbr.Setup()


def test_the_key_is_of_the_content(drive: twbr.Drive) -> None:
    recording = drive.recording
    assert replace(drive, recording=replace(recording, source="elsewhere")).key == drive.key
    gyro = recording.imu.gyro.copy()
    gyro[-1, 1] += 1e-9
    other = replace(drive, recording=replace(recording, imu=replace(recording.imu, gyro=gyro)))
    assert other.key != drive.key
    assert drive.with_terms("wheel").key != drive.key


def test_pairing_and_correction_are_done_once_and_when_needed(bag: Path) -> None:
    drive = twbr.load(bag)
    assert not {"samples", "corrected"} & set(vars(drive))
    assert drive.corrected is drive.corrected
    assert drive.with_terms().samples is drive.samples
    assert drive.with_setup(drive.setup).corrected is drive.corrected
    reference = drive.recording.reference
    assert reference is not None
    assert drive.with_reference(reference).corrected is drive.corrected


def test_runs_hold_all_that_a_filter_estimates(drive: twbr.Drive, runs: twbr.Runs) -> None:
    assert tuple(runs) == NAMES and len(runs) == 2
    assert [each.tilt.size for each in runs.values()] == [400, 400]
    found = runs["ins_odometer"]
    assert found.time == pytest.approx(np.arange(400) * 0.01)
    for name in ("tilt", "rate", "gyro_bias", "tilt_variance"):
        assert np.ptp(getattr(found, name)) > 0.0
    with pytest.raises(KeyError, match="'kalman' was not run; there are: complementary"):
        runs["kalman"]


def test_the_printed_scores_are_the_table_of_evaluate(
    bag: Path, runs: twbr.Runs, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["evaluate", str(bag), *(f"--filter={name}" for name in NAMES)]) == 0

    def cells(text: str) -> list[list[str]]:
        return [line.split() for line in text.splitlines() if line.startswith("│")]

    printed = cells(capsys.readouterr().out)
    assert len(printed) == 2
    assert cells(str(runs.scores())) == printed


def test_scores_are_columns_and_take_other_options(runs: twbr.Runs) -> None:
    scores = runs.scores()
    table = scores.to_columns()
    assert table["estimator"] == list(NAMES)
    assert table["mse_deg2"] == [scores.estimators[name].mse_deg2 for name in NAMES]
    later = runs.scores(twbr.ScoringOptions(skip=1.0))
    assert later.estimators["ins_odometer"].samples == 300
    assert runs.scores() == scores


def test_a_table_is_one_column_a_quantity(runs: twbr.Runs) -> None:
    columns = runs.to_columns()
    assert list(columns)[:4] == ["time", "reference", "complementary.tilt", "complementary.rate"]
    assert {column.shape for column in columns.values()} == {(400,)}
    table = runs.to_numpy()
    assert table.dtype.names == tuple(columns)
    np.testing.assert_array_equal(table["ins_odometer.tilt"], runs["ins_odometer"].tilt)


@pytest.mark.parametrize("package", ["pandas", "polars"])
def test_frames(runs: twbr.Runs, package: str) -> None:
    pytest.importorskip(package)
    frame = getattr(runs, f"to_{package}")()
    assert frame.shape == (400, 10)
    np.testing.assert_array_equal(frame["ins_odometer.rate"], runs["ins_odometer"].rate)


def test_a_missing_package_is_named(runs: twbr.Runs, monkeypatch: pytest.MonkeyPatch) -> None:
    for package in ("pandas", "polars"):
        monkeypatch.setitem(sys.modules, package, None)
        with pytest.raises(twbr.TwbrError, match=f"pip install {package}"):
            getattr(runs, f"to_{package}")()
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    with pytest.raises(twbr.TwbrError, match="needs matplotlib"):
        runs.plot()


def test_the_plot_is_in_degrees_over_seconds(runs: twbr.Runs) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = runs.plot()
    lines = {line.get_label(): line for line in axes.get_lines()}
    assert list(lines) == [*NAMES, "reference"]
    np.testing.assert_allclose(lines["ins_odometer"].get_xdata(), runs["ins_odometer"].time)
    tilt = np.degrees(runs["ins_odometer"].tilt)
    np.testing.assert_allclose(lines["ins_odometer"].get_ydata(), tilt)
    assert axes.get_xlabel() == "time [s]" and axes.get_ylabel() == "tilt [deg]"
    assert runs.plot(axes) is axes


def test_values_and_terms_act(drive: twbr.Drive, runs: twbr.Runs) -> None:
    slow = drive.run("complementary", values={"complementary": {"time_constant": 9.0}})
    assert not np.array_equal(slow["complementary"].tilt, runs["complementary"].tilt)
    assert slow.parameters["complementary"]["time_constant"] == 9.0
    plain = drive.with_terms().run("complementary")
    assert not np.array_equal(plain["complementary"].tilt, runs["complementary"].tilt)


def test_without_a_reference_there_are_runs_but_no_scores(
    drive: twbr.Drive, tmp_path: Path
) -> None:
    write_recording(tmp_path / "bag", replace(drive.recording, reference=None, truth=None))
    loaded = twbr.load(tmp_path / "bag")
    blind = loaded.run("gyro")
    assert "reference" not in blind.to_columns()
    assert any("no robot is described there" in warning for warning in blind.warnings)
    with pytest.raises(twbr.TwbrError, match="no reference to compare with"):
        blind.scores()


def test_simulations_are_drives() -> None:
    one, same = (twbr.simulate("W2", seed=7, dt=0.01, duration=1.0) for _ in range(2))
    assert one.key == same.key != twbr.simulate("W2", seed=8, dt=0.01, duration=1.0).key
    assert one.recording.truth is not None
    assert one.run("gyro").scores().estimators["gyro"].samples == 100


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda drive: twbr.load(3), "`path`: 3 is not a str or a Path"),
        (lambda drive: twbr.load("here", config=3), "`config`: 3 is not"),
        (lambda drive: twbr.load("nowhere"), "nowhere: there is no such recording"),
        (
            lambda drive: twbr.load(".", loop_period=-1.0),
            "`loop_period`: -1.0 is no number from 0",
        ),
        (lambda drive: twbr.load(".", terms=["gravity"]), "`terms`: there is no 'gravity'"),
        (lambda drive: drive.run("no_filter"), "there is no filter 'no_filter'"),
        (lambda drive: drive.run(["kalman"]), "`names`: .*give each as an argument of its own"),
        (lambda drive: drive.run("gyro", values={"kalman": {}}), "`values`: kalman has values"),
        (lambda drive: drive.run("gyro", values={"gyros": {}}), "`values`: gyros is no filter"),
        (
            lambda drive: drive.run("gyro", values={"gyro": 3}),
            "`values.*gyro.*`: 3 is not",
        ),
        (lambda drive: drive.run("gyro", values=3), "`values`: 3 is not a mapping"),
        (lambda drive: drive.run("kalman", values={"kalman": {"q1": -1}}), "kalman.q1: -1 is out"),
        (lambda drive: twbr.simulate("W9"), "W9"),
        (lambda drive: twbr.Estimator(3), "`filter`: 3 is not"),
        (lambda drive: twbr.Estimator("gyro", 3), "`robot`: 3 is not"),
    ],
)
def test_wrong_arguments_get_errors_in_their_words(
    drive: twbr.Drive, wrong: Any, said: str
) -> None:
    with pytest.raises(twbr.TwbrError, match=said) as caught:
        wrong(drive)
    assert "--" not in str(caught.value)


def test_the_estimator_gives_the_numbers_of_the_live_path(drive: twbr.Drive) -> None:
    """Those of the nodes' streams, and of the recording's run, bit by bit."""
    samples = [Sample(*column) for column in drive.samples.columns.T.tolist()]
    estimator = twbr.Estimator("ins_odometer", drive.setup)
    stepped = [
        estimator.step(s.dt, s[1:4], s[4:7], [s.wheel_angle] if s.wheel_count else None)
        for s in samples
    ]
    stream = FilterStream(
        FilterConfiguration(FilterSettings("ins_odometer"), robot=drive.setup.robot)
    )
    corrector = Corrector(drive.setup)
    assert stepped == [stream.step(corrector.step(sample)) for sample in samples]
    run = drive.run("ins_odometer")["ins_odometer"]
    np.testing.assert_array_equal(run.columns.T, stepped)
    assert estimator.estimate == stepped[-1]


def test_the_estimator_corrects_as_the_correction_node(drive: twbr.Drive) -> None:
    """Readings that arrive one by one, wheels with two encoders at the samples' stamps."""
    setup = replace(
        drive.setup,
        robot=replace(
            drive.setup.robot, track_width=0.2, encoder_placement=EncoderPlacement.GROUND
        ),
    )
    live, estimator = CorrectionStream(setup, wait=0.0), twbr.Estimator("accelerometer", setup)
    imu = drive.recording.imu
    for index, stamp in enumerate(imu.stamps.tolist()[:50]):
        angles = (0.1 * index, 0.12 * index + 0.3 * math.sin(index))
        live.add_wheels(wheel_reading(stamp, angles))
        ((_, corrected),) = live.add_imu(stamp, (*imu.gyro[index], *imu.accel[index]))
        dt = corrected.dt
        estimate = estimator.step(dt, imu.gyro[index], imu.accel[index], angles)
        assert estimate.tilt == pytest.approx(corrected.angle, abs=1e-12)


@pytest.mark.parametrize("every", [2, 5])
def test_the_estimator_pairs_a_slower_encoder_as_the_nodes_do(
    drive: twbr.Drive, every: int
) -> None:
    imu, wheels = drive.recording.imu, drive.recording.wheels
    assert wheels is not None
    angle = np.stack([np.interp(imu.stamps, wheels.stamps, each) for each in wheels.angle.T], 1)
    slower = twbr.WheelTrack(imu.stamps[::every], angle[::every])
    paired = pair(imu, slower, wait=0.0)
    estimator = twbr.Estimator("complementary", drive.setup)
    stepped = [
        estimator.step(dt, gyro, accel, None if index % every else angle[index])
        for index, (dt, gyro, accel) in enumerate(
            zip(paired.field("dt").tolist(), imu.gyro, imu.accel, strict=True)
        )
    ]
    run, entry = correct(paired, drive.setup), filter_named("complementary")
    expected = run_filter(entry, entry.configure(), run, drive.setup.robot)
    np.testing.assert_array_equal(expected.columns.T, stepped)


def test_the_estimator_starts_afresh_after_reset() -> None:
    estimator = twbr.Estimator("complementary")
    assert estimator.estimate is None
    first = estimator.step(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 9.81))
    estimator.step(0.01, (0.0, 1.0, 0.0), (-1.0, 0.0, 9.81))
    estimator.reset()
    assert estimator.step(0.01, (0.0, 0.0, 0.0), (0.0, 0.0, 9.81)) == first


def test_the_estimator_forgets_the_wheels_of_a_sample_that_could_not_start_it() -> None:
    gyro = filter_named("gyro")

    def begins_near_zero(estimate: Any, sample: Any, c: Any) -> Any:
        if sample.wheel_angle > 0.5:
            raise ValueError("not yet")
        return gyro.reset(estimate, sample, c)

    estimator = twbr.Estimator(replace(gyro, name="mine", reset=begins_near_zero))
    with pytest.raises(ValueError, match="not yet"):
        estimator.step(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 9.81), 1.0)
    estimator.step(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 9.81), 0.25)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((0.01, (1.0, 2.0), (0.0, 0.0, 9.8)), "`gyro`: .* 3 finite numbers"),
        ((0.01, (0.0, 0.0, 0.0), (0.0, math.nan, 9.8)), "`accel`: .* 3 finite numbers"),
        ((0.01, (0.0, 0.0, 0.0), (0.0, 0.0, 9.8), (1, 2, 3)), "`wheels`: .* 1 or 2 finite"),
        ((0.01, (0.0, 0.0, 0.0), (0.0, 0.0, 9.8), 1.0, "fast"), "`motors`: 'fast'"),
        ((-0.01, (0.0, 0.0, 0.0), (0.0, 0.0, 9.8)), "`dt`: -0.01 is no number from 1e-09"),
        ((math.inf, (0.0, 0.0, 0.0), (0.0, 0.0, 9.8)), "`dt`: inf"),
    ],
)
def test_readings_that_cannot_be_used_are_refused(arguments: Any, said: str) -> None:
    estimator = twbr.Estimator("complementary", twbr.Robot())
    estimator.step(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 9.8))
    before = estimator.estimate
    with pytest.raises(twbr.TwbrError, match=said):
        estimator.step(*arguments)
    assert estimator.estimate == before


def test_a_variant_of_a_filter_runs_beside_it(drive: twbr.Drive) -> None:
    variant = replace(filter_named("complementary"), name="mine")
    both = drive.run("complementary", variant)
    np.testing.assert_array_equal(both["mine"].tilt, both["complementary"].tilt)
    impostor = replace(filter_named("complementary"), name="kalman")
    with pytest.raises(twbr.TwbrError, match="two different filters have the name kalman"):
        drive.run("kalman", impostor)
