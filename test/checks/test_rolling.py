"""A gyro or accelerometer that contradicts the wheels of a robot that rolls."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import twbr_estimation as twbr
from twbr_estimation.batch import correct
from twbr_estimation.checks.finding import Finding
from twbr_estimation.checks.quick import QuickChecks, contradicted
from twbr_estimation.checks.rolling import RollingCheck
from twbr_estimation.pipeline.correction import Corrector
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.recording import FloatArray, ImuTrack
from twbr_estimation.samples import STANDARD_GRAVITY, CorrectedSample, Sample
from twbr_estimation.simulation.hard_days import DAYS
from twbr_estimation.simulation.simulated_robot import SimulatedRobot
from twbr_estimation.streams.filter_configuration import FilterConfiguration, FilterSettings
from twbr_estimation.streams.filtering import FilterStream

FIELDS = CorrectedSample._fields
GYRO_X, GYRO_Y, GYRO_Z = map(FIELDS.index, ("gyro_x", "gyro_y", "gyro_z"))
FORCE_X, WHEELS = map(FIELDS.index, ("accel_x", "wheel_angle"))
Change = Callable[[FloatArray], None]


@pytest.fixture(scope="module")
def samples() -> FloatArray:
    """Corrected samples of a simulated robot that balances and drives, (fields, n)."""
    found: FloatArray = twbr.simulate(
        "W1", seed=311, dt=0.005, duration=30.0, scene="drive"
    ).corrected_samples.columns
    return found


def negated(row: int) -> Change:
    def change(columns: FloatArray) -> None:
        columns[row] *= -1.0

    return change


def swapped(columns: FloatArray) -> None:
    columns[[GYRO_X, GYRO_Y]] = columns[[GYRO_Y, GYRO_X]]


def forces_swapped(columns: FloatArray) -> None:
    columns[[FORCE_X, FORCE_X + 1]] = columns[[FORCE_X + 1, FORCE_X]]


def in_g(columns: FloatArray) -> None:
    columns[FORCE_X : FORCE_X + 3] /= STANDARD_GRAVITY


def scaled(factor: float) -> Change:
    def change(columns: FloatArray) -> None:
        columns[[GYRO_X, GYRO_Y, GYRO_Z]] *= factor

    return change


def findings(columns: FloatArray) -> tuple[Finding, ...]:
    """Return what is wrong after the last sample."""
    checks = QuickChecks()
    for values in columns.T.tolist():
        checks.add(CorrectedSample._make(values))
    return checks.untrusted


@pytest.mark.parametrize(
    ("change", "check"),
    [
        (negated(GYRO_Y), "sign"),
        (negated(FORCE_X), "sign"),
        (swapped, "axes"),
        (forces_swapped, "axes"),
        (in_g, "unit"),
        (scaled(math.degrees(1.0)), "unit"),
        (scaled(0.25), "unit"),
        (scaled(0.5), "unit"),
        (scaled(2.0), "unit"),
        (scaled(4.0), "unit"),
    ],
)
def test_a_wrong_sensor_is_found_while_the_robot_rolls_and_stays_found(
    samples: FloatArray, change: Change, check: str
) -> None:
    wrong = samples.copy()
    change(wrong)
    found = contradicted(wrong)
    assert found.any(), "not found"
    first = int(np.argmax(found))
    assert found[first:].all(), "forgotten"
    assert np.cumsum(wrong[0])[first] < 12.0
    assert [each.check for each in findings(wrong[:, : first + 1])] == [check]


@pytest.mark.parametrize(
    ("factor", "name"),
    [
        (0.25, "a quarter of the full scale"),
        (0.5, "half the full scale"),
        (2.0, "twice the full scale"),
        (4.0, "a full scale four times as large"),
    ],
)
def test_another_full_scale_is_named_with_the_parameter(
    samples: FloatArray, factor: float, name: str
) -> None:
    wrong = samples.copy()
    scaled(factor)(wrong)
    (found,) = findings(wrong)
    assert name in found.text and found.parameter == "calibration.gyro_scale"
    assert found.ratio == pytest.approx(factor, rel=0.1)


def test_another_scale_that_looks_right_for_a_second_stays_found() -> None:
    columns = twbr.simulate(
        "W1", seed=98001, dt=0.005, duration=20.0
    ).corrected_samples.columns.copy()
    scaled(2.0)(columns)
    found = contradicted(columns)
    assert found[int(np.argmax(found)) :].all()


def test_an_accelerometer_of_another_scale_is_not_taken_for_the_gyros(samples: FloatArray) -> None:
    wrong = samples.copy()
    wrong[FORCE_X : FORCE_X + 3] *= 0.5
    assert not contradicted(wrong).any()


def test_a_gyro_in_degrees_is_found_where_the_robot_leans_little() -> None:
    """Its turn looks too large there for an upright robot."""
    columns = twbr.simulate(
        "W1", seed=315, dt=0.005, duration=25.0, scene="drive"
    ).corrected_samples.columns
    checks, turn = RollingCheck(), 0.0
    for index, values in enumerate(columns.T.tolist()):
        sample = CorrectedSample._make(values)
        rate = math.degrees(sample.gyro_y)
        turn += rate * sample.dt
        checks.add(sample._replace(gyro_y=rate), turn)
        if index % 20 == 19:
            checks.end_block(20)
        if checks.wrong is not None:
            break
    assert checks.wrong is not None and checks.wrong.check == "unit"


def late(seconds: float) -> Change:
    def change(columns: FloatArray) -> None:
        time = np.cumsum(columns[0])
        columns[WHEELS] = np.interp(time - seconds, time, columns[WHEELS])

    return change


def coarse(columns: FloatArray) -> None:
    step = 2.0 * np.pi / 48.0
    columns[WHEELS] = step * np.round(columns[WHEELS] / step)


def drifting(columns: FloatArray) -> None:
    walk = np.random.default_rng(3).standard_normal(columns.shape[1])
    columns[WHEELS] = np.cumsum(0.01 * walk)


@pytest.mark.parametrize(
    "change", [late(0.0), late(0.05), late(-0.03), negated(WHEELS), coarse, drifting]
)
def test_whatever_the_wheels_show_right_sensors_are_not_doubted(
    samples: FloatArray, change: Change
) -> None:
    shown = samples.copy()
    change(shown)
    assert not contradicted(shown).any()


@pytest.mark.parametrize("seed", [11, 13, 14])
def test_a_robot_that_a_simulator_sets_upright_is_not_called_wrong(seed: int) -> None:
    """It falls without its motors, is upright from one sample to the next, and rolls."""
    period, voltage, before = 0.005, 0.0, 0.0
    robot = SimulatedRobot("W2", seed, period, stay_down=True)
    corrector, checks = Corrector(robot.setup), QuickChecks()
    for index in range(6000):
        phase = index % 1500
        for reading in robot.advance((voltage, voltage), period):
            (wheel,) = reading.wheels
            sample = Sample(robot.time - before, *reading.imu, wheel, 0.0, 1.0, 0.0, 0.0, 0.0)
            before = robot.time
            checks.add(corrector.step(sample))
        assert not checks.untrusted, robot.time
        if phase == 500:
            assert robot.held, "it has not fallen"
            robot.place()
        true = robot.truth
        speed = 0.3 * math.sin(0.02 * phase)
        pull = 60.0 * true.tilt + 6.0 * true.rate + 8.0 * (true.velocity - speed)
        voltage = pull if phase > 500 else 0.0


@pytest.mark.parametrize("lean", [0.0, 0.3])
@pytest.mark.parametrize("seconds", [0.02, 0.1])
def test_late_wheels_of_a_robot_that_hardly_leans_make_nothing_wrong(
    seconds: float, lean: float
) -> None:
    """It rolls on a castor: what late wheels leave of its acceleration is no leaning."""
    time = np.arange(0.0, 15.0, 0.005)
    force = 2.0 * np.sin(2.0 * math.pi * 0.7 * time) + 1.5 * np.sin(2.0 * math.pi * 1.2 * time)
    turn = math.radians(lean) * np.sin(2.0 * math.pi * 0.8 * time)
    columns = np.zeros((len(FIELDS), time.size))
    columns[0], columns[FORCE_X + 2], columns[WHEELS + 2] = 0.005, STANDARD_GRAVITY, 1.0
    columns[FORCE_X] = force - STANDARD_GRAVITY * turn
    noise = 0.002 * np.random.default_rng(5).standard_normal(time.size)
    columns[GYRO_Y] = np.gradient(turn, 0.005) + noise
    columns[WHEELS] = np.cumsum(np.cumsum(force / 0.04)) * 0.005**2
    late(seconds)(columns)
    assert not contradicted(columns).any()


@pytest.mark.parametrize(
    "day", ["spins, sensor 20 mm aside", "carried, wheels run", "encoder 20 to 60 ms late"]
)
def test_whatever_happens_to_the_robot_right_sensors_are_not_doubted(day: str) -> None:
    made = DAYS[day](97001, 0.01)
    track = correct(pair(made.recording.imu, made.recording.wheels), made.setup)
    assert not contradicted(track.columns).any()


def test_the_right_sign_ends_what_was_found(samples: FloatArray) -> None:
    both = np.hstack([samples, samples])
    negated(GYRO_Y)(both[:, : samples.shape[1]])
    found = contradicted(both)
    assert found[samples.shape[1] - 1] and not found[-1]


def test_what_has_once_been_right_is_not_doubted_any_more(samples: FloatArray) -> None:
    both = np.hstack([samples, samples])
    negated(GYRO_Y)(both[:, samples.shape[1] :])
    assert not contradicted(both).any()


def test_readings_beyond_any_sensor_raise_nothing(samples: FloatArray) -> None:
    wild = samples[:, :2000].copy()
    wild[GYRO_Y, 500:] = 1e200
    contradicted(wild)


def test_a_live_tilt_is_invalid_until_the_robot_is_described_anew(samples: FloatArray) -> None:
    settings = FilterSettings("complementary")
    stream = FilterStream(FilterConfiguration(settings))
    for values in samples.T.tolist():
        sample = CorrectedSample(*values)
        stream.step(sample._replace(gyro_y=-sample.gyro_y))
    assert not stream.trusted
    stream.configure(FilterConfiguration(settings, robot=twbr.Robot(wheel_radius=0.04)))
    stream.step(sample)
    assert stream.trusted


@pytest.mark.parametrize("filter_", ["complementary", "ins_odometer", "kalman_adaptive"])
def test_without_ros_a_contradicted_tilt_is_not_trusted(filter_: str) -> None:
    drive = twbr.simulate("W1", seed=313, dt=0.01, duration=12.0, scene="drive")
    sound, wrong = (twbr.Estimator(filter_, drive.setup) for _ in range(2))
    for values in drive.samples.columns.T.tolist():
        sample = Sample._make(values)
        x, y, z = sample[1:4]
        sound.step(sample.dt, (x, y, z), sample[4:7], sample.wheel_angle)
        wrong.step(sample.dt, (x, -y, z), sample[4:7], sample.wheel_angle)
    assert sound.trusted and sound.contradictions == ()
    assert not wrong.trusted and [each.check for each in wrong.contradictions] == ["sign"]
    wrong.reset()
    assert wrong.contradictions == ()


def test_a_recording_is_valid_where_its_live_stream_is() -> None:
    drive = twbr.simulate("W1", seed=312, dt=0.01, duration=20.0, scene="drive")
    imu = drive.recording.imu
    wrong = ImuTrack(imu.stamps, imu.gyro * (1.0, -1.0, 1.0), imu.accel)
    turned = replace(drive, recording=replace(drive.recording, imu=wrong))
    runs = turned.run("complementary")
    usable = ~contradicted(turned.corrected.columns)
    assert 0.1 < np.mean(usable) < 0.6
    assert runs.trusted["complementary"] <= np.mean(usable)
    assert drive.run("complementary").trusted["complementary"] > 0.95
