"""One fault at a time in a simulated drive, and the finding it must give."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.checks.check import check
from twbr_estimation.checks.finding import Finding, Severity, noteworthy
from twbr_estimation.recording import Recording
from twbr_estimation.robot import EncoderPlacement, Setup
from twbr_estimation.simulation import Simulated, simulate

Faulty = tuple[Recording, Setup]


@pytest.fixture(scope="module")
def drive() -> Simulated:
    """Return a drive of a robot that turns, with two encoders."""
    return simulate("W4", 0.005, 30.0, 301)


def faults(recording: Recording, setup: Setup) -> dict[str, Finding]:
    """Return the findings by subject and check, without saturation, which a drive has."""
    found = noteworthy(check(recording, setup))
    return {f"{each.subject} {each.check}": each for each in found if each.check != "saturation"}


def gyro(by: Callable[[np.ndarray], np.ndarray]) -> Callable[[Simulated], Faulty]:
    def faulty(drive: Simulated) -> Faulty:
        imu, calibration = drive.recording.imu, drive.setup.calibration
        bias = tuple(by(np.array([calibration.gyro_bias]))[0].tolist())
        setup = replace(drive.setup, calibration=replace(calibration, gyro_bias=bias))
        return replace(drive.recording, imu=replace(imu, gyro=by(imu.gyro))), setup

    return faulty


def gyro_by(by: Callable[[np.ndarray], np.ndarray]) -> Callable[[Simulated], Faulty]:
    """Return a fault that comes after the calibration, at a robot that never rests."""

    def faulty(drive: Simulated) -> Faulty:
        imu = drive.recording.imu
        moving = replace(drive.recording, imu=replace(imu, gyro=by(imu.gyro)))
        robot = replace(drive.setup.robot, gyro_range=35.0)
        return moving, replace(drive.setup, robot=robot)

    return faulty


def accelerometer(by: Callable[[np.ndarray], np.ndarray]) -> Callable[[Simulated], Faulty]:
    def faulty(drive: Simulated) -> Faulty:
        imu = drive.recording.imu
        return replace(drive.recording, imu=replace(imu, accel=by(imu.accel))), drive.setup

    return faulty


def wheels(
    by: Callable[[np.ndarray], np.ndarray], late: float = 0.0
) -> Callable[[Simulated], Faulty]:
    def faulty(drive: Simulated) -> Faulty:
        track = drive.recording.wheels
        assert track is not None
        track = replace(track, angle=by(track.angle), stamps=track.stamps + round(late * 1e9))
        return replace(drive.recording, wheels=track), drive.setup

    return faulty


def robot(**changes: object) -> Callable[[Simulated], Faulty]:
    def faulty(drive: Simulated) -> Faulty:
        setup = replace(drive.setup, robot=replace(drive.setup.robot, **changes))  # type: ignore[arg-type]
        return drive.recording, setup

    return faulty


def restarted(angle: np.ndarray) -> np.ndarray:
    later = angle.copy()
    later[angle.shape[0] // 2 :] -= angle[angle.shape[0] // 2]
    return later


def counted_in_16_bit(angle: np.ndarray) -> np.ndarray:
    step = 2.0 * np.pi / 20_000
    return ((np.round(angle / step) + 32768) % 65536 - 32768) * step


def quantised(angle: np.ndarray, counts: int) -> np.ndarray:
    step = 2.0 * np.pi / counts
    return np.floor(angle / step) * step


def noisy(angle: np.ndarray) -> np.ndarray:
    return angle + 0.1 * np.random.default_rng(5).standard_normal(angle.shape)


def spiky(angle: np.ndarray) -> np.ndarray:
    spikes = angle.copy()
    for begin in range(100, angle.shape[0] - 2, 217):
        spikes[begin : begin + 2] += 3.0 * begin
    return spikes


def carried(angle: np.ndarray) -> np.ndarray:
    """Return wheels that stand still for 8 s of the drive."""
    held = angle.copy()
    held[2000:3600] = angle[2000]
    held[3600:] += angle[2000] - angle[3599]
    return held


def halted(angle: np.ndarray) -> np.ndarray:
    """Return wheels whose readings stay the same in the second half."""
    result = angle.copy()
    result[len(angle) // 2 :] = result[len(angle) // 2]
    return result


def repeated(angle: np.ndarray, times: int) -> np.ndarray:
    return angle[np.arange(len(angle)) // times * times]


def turned(angle: float) -> Callable[[Simulated], Faulty]:
    """Return a fault: the IMU sits turned about the vertical, and `mounting` does not say so."""
    cosine, sine = np.cos(angle), np.sin(angle)
    seen = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])

    def faulty(drive: Simulated) -> Faulty:
        recording, setup = gyro(lambda v: v @ seen.T)(drive)
        imu = replace(recording.imu, accel=recording.imu.accel @ seen.T)
        return replace(recording, imu=imu), setup

    return faulty


def stuck(sensor: str, axis: int, value: float | None = None) -> Callable[[Simulated], Faulty]:
    def faulty(drive: Simulated) -> Faulty:
        imu = drive.recording.imu
        values = getattr(imu, sensor).copy()
        values[:, axis] = values[0, axis] if value is None else value
        return replace(drive.recording, imu=replace(imu, **{sensor: values})), drive.setup

    return faulty


def dead(sensor: str, value: float) -> Callable[[Simulated], Faulty]:
    def faulty(drive: Simulated) -> Faulty:
        imu = drive.recording.imu
        values = np.full_like(getattr(imu, sensor), value)
        return replace(drive.recording, imu=replace(imu, **{sensor: values})), drive.setup

    return faulty


def reference(
    by: Callable[[np.ndarray], np.ndarray], late: float = 0.0
) -> Callable[[Simulated], Faulty]:
    def faulty(drive: Simulated) -> Faulty:
        track = drive.recording.reference
        assert track is not None
        track = replace(track, tilt=by(track.tilt), stamps=track.stamps + round(late * 1e9))
        return replace(drive.recording, reference=track), drive.setup

    return faulty


CASES = {
    "wheels backward": (wheels(lambda a: -a), "wheels sign", -1.0),
    "wheels in degrees": (wheels(np.degrees), "wheels scale", 57.3),
    "wheels in counts": (wheels(lambda a: a * 1320 / (2 * np.pi)), "wheels scale", 210.1),
    "wheels before the gear": (wheels(lambda a: 30.0 * a), "wheels scale", 30.0),
    "wheels behind a gear": (wheels(lambda a: a / 30.0), "wheels scale", 1 / 30.0),
    "left wheel mirrored": (wheels(lambda a: a * [-1.0, 1.0]), "wheels sign", None),
    "right wheel mirrored": (wheels(lambda a: a * [1.0, -1.0]), "wheels sign", None),
    "left wheel dead": (wheels(lambda a: a * [0.0, 1.0]), "wheels dead", None),
    "both wheels dead": (wheels(lambda a: 0.0 * a), "wheels dead", None),
    "left wheel in degrees": (wheels(lambda a: a * [180 / np.pi, 1.0]), "wheels scale", 57.3),
    "right wheel counted four times": (wheels(lambda a: a * [1.0, 4.0]), "wheels scale", 4.0),
    "wheels noisy": (wheels(noisy), "wheels noise", 5.0),
    "wheels of 24 counts": (wheels(lambda a: quantised(a, 24)), "wheels resolution", 0.262),
    "wheels read every 15 ms": (wheels(lambda a: repeated(a, 3)), "wheels repeats", 3.0),
    "wheels with spikes": (wheels(spiky), "wheels jumps", None),
    "wheels at rest while carried": (wheels(carried), "wheels rolling", None),
    "wheels late": (wheels(lambda a: a, late=0.2), "wheels clock", 0.2),
    "wheels early": (wheels(lambda a: a, late=-0.1), "wheels clock", -0.1),
    "wheels of another clock": (wheels(lambda a: a, late=1e9), "wheels clock", 1e9),
    "wheels late by 1 s": (wheels(lambda a: a, late=1.0), "wheels clock", 1.0),
    "wheels early by 2.5 s": (wheels(lambda a: a, late=-2.5), "wheels clock", -2.5),
    "wheels swapped": (wheels(lambda a: a[:, ::-1]), "wheels sides", None),
    "counter restarted": (wheels(restarted), "wheels jumps", None),
    "counter of 16 bit": (wheels(counted_in_16_bit), "wheels jumps", None),
    "gyro backward": (gyro(lambda v: -v), "gyro sign", -1.0),
    "gyro in deg/s": (gyro(np.degrees), "gyro unit", 57.3),
    "gyro axes swapped": (gyro(lambda v: v[:, [1, 0, 2]]), "gyro axes", 1.0),
    "gyro y dead": (stuck("gyro", 1, 0.0), "gyro dead axis", None),
    "gyro y stuck": (stuck("gyro", 1), "gyro dead axis", None),
    "gyro z stuck": (stuck("gyro", 2), "gyro dead axis", None),
    "gyro never filled in": (dead("gyro", 0.0), "gyro dead", None),
    "gyro frozen": (dead("gyro", 0.01), "gyro dead", None),
    "accelerometer x stuck": (stuck("accel", 0), "accelerometer dead axis", None),
    "accelerometer y stuck": (stuck("accel", 1), "accelerometer dead axis", None),
    "accelerometer z dead": (stuck("accel", 2, 0.0), "accelerometer dead axis", None),
    "accelerometer never filled in": (dead("accel", 0.0), "accelerometer dead", None),
    "accelerometer in counts": (
        accelerometer(lambda v: v * 16384 / 9.80665),
        "accelerometer unit",
        16384 / 9.80665,
    ),
    "reference of another clock": (reference(lambda t: t, late=1e9), "reference clock", 1e9),
    "reference in half turns": (reference(lambda t: t / 180.0), "reference scale", 180.0),
    "wheels in mm": (wheels(lambda a: 37.5 * a), "wheels scale", 37.5),
    "both wheels dead for a while": (wheels(halted), "wheels rolling", None),
    "gyro biased": (gyro_by(lambda v: v + np.array([0.0, 1.0, 0.0])), "gyro bias", None),
    "gyro z dead": (stuck("gyro", 2, 0.0), "gyro dead axis", None),
    "reference dead": (reference(lambda t: 0.0 * t), "reference dead", None),
    "reference not upright": (reference(lambda t: t + 0.3), "reference zero", 0.3),
    "accelerometer in g": (accelerometer(lambda v: v / 9.80665), "accelerometer unit", 0.102),
    "gravity removed": (accelerometer(lambda v: v - [0, 0, 9.4]), "accelerometer unit", None),
    "gravity negated": (accelerometer(lambda v: -v), "accelerometer direction", -1.0),
    "x and y swapped": (accelerometer(lambda v: v[:, [1, 0, 2]]), "accelerometer axes", 1.0),
    "x and z swapped": (accelerometer(lambda v: v[:, [2, 1, 0]]), "accelerometer axes", None),
    "radius of 0.8 m": (robot(wheel_radius=0.8), "wheels radius", 21.3),
    "lever arm of 1.5 m": (robot(lever_arm=(0.0, 0.0, 1.5)), "robot lever arm", 1.5 / 0.138),
}
"""Name: what is done, the finding it gives, and the ratio found."""


def test_nothing_is_found_in_a_good_drive(drive: Simulated) -> None:
    assert faults(drive.recording, drive.setup) == {}


@pytest.mark.parametrize("name", CASES)
def test_a_fault_is_found_with_its_ratio(drive: Simulated, name: str) -> None:
    fault, key, ratio = CASES[name]
    found = faults(*fault(drive))
    assert key in found, found
    if ratio is not None:
        assert found[key].ratio == pytest.approx(ratio, rel=0.2)
    about_reference = [each for each in found if each.startswith("reference")]
    assert len(found) - len(about_reference) <= 2, "one cause, one finding"


def test_a_suggestion_mends_what_it_is_for(drive: Simulated) -> None:
    recording, setup = robot(wheel_radius=0.8)(drive)
    value = faults(recording, setup)["wheels radius"].value
    assert value == pytest.approx(drive.true_setup.robot.wheel_radius, rel=0.1)
    mended = replace(setup, robot=replace(setup.robot, wheel_radius=value))
    assert faults(recording, mended) == {}


@pytest.mark.parametrize("degrees", [90, 180, -90])
@pytest.mark.parametrize("with_reference", [True, False])
def test_a_sensor_turned_about_the_vertical_is_named(
    drive: Simulated, degrees: int, with_reference: bool
) -> None:
    recording, setup = turned(np.radians(degrees))(drive)
    found = faults(recording if with_reference else replace(recording, reference=None), setup)
    assert "wheels sign" not in found
    mounting = found["IMU mounting"].value
    expected = np.remainder(np.radians(degrees), 2.0 * np.pi)
    assert np.remainder(mounting, 2.0 * np.pi) == pytest.approx([0.0, 0.0, expected], abs=1e-3)


def test_without_turns_and_reference_a_turned_sensor_is_one_of_two_causes() -> None:
    drive = simulate("W1", 0.005, 30.0, 304)
    recording, setup = turned(np.pi)(drive)
    (found,) = faults(replace(recording, reference=None), setup).values()
    assert "turned by 180 deg" in found.text and "`signs`" in found.text
    assert "IMU mounting" in faults(recording, setup)


def test_a_wheel_that_turns_on_in_a_hole_does_not_jump(drive: Simulated) -> None:
    def holed(recording: Recording, angle: np.ndarray) -> Recording:
        imu, track = recording.imu, recording.wheels
        assert track is not None
        kept = np.abs(1e-9 * (track.stamps - track.stamps[0]) - 11.0) > 2.0
        wheels = replace(track, stamps=track.stamps[kept], angle=angle[kept])
        readings = replace(imu, stamps=imu.stamps[kept], gyro=imu.gyro[kept], accel=imu.accel[kept])
        return replace(recording, imu=readings, wheels=wheels)

    track = drive.recording.wheels
    assert track is not None
    far = track.angle + 20.0 * (track.stamps > track.stamps[0] + 11_000_000_000)[:, None]
    assert "wheels jumps" not in faults(holed(drive.recording, far), drive.setup)
    assert "wheels sign" in faults(holed(drive.recording, -far), drive.setup)


def test_spikes_are_not_a_counter_that_wraps(drive: Simulated) -> None:
    assert "spikes" in faults(*wheels(spiky)(drive))["wheels jumps"].text
    assert "wraps" in faults(*wheels(counted_in_16_bit)(drive))["wheels jumps"].text


def test_a_part_in_which_the_robot_is_carried_is_named_with_its_time(drive: Simulated) -> None:
    found = faults(*wheels(carried)(drive))["wheels rolling"]
    assert found.severity is Severity.WARN and "from 10 s to 18 s" in found.text


@pytest.mark.parametrize("world", ["W1", "W2", "W3", "W4"])
@pytest.mark.parametrize("seed", [311, 312, 313])
def test_nothing_is_found_in_honest_drives(world: str, seed: int) -> None:
    drive = simulate(world, 0.01, 30.0, seed)
    allowed = {"wheels slip"} if drive.world.slips_per_second else set()
    assert set(faults(drive.recording, drive.setup)) <= allowed
    assert set(faults(replace(drive.recording, reference=None), drive.setup)) <= allowed


def test_one_mirrored_wheel_is_named(drive: Simulated) -> None:
    found = faults(*wheels(lambda a: a * [1.0, -1.0])(drive))["wheels sign"]
    assert found.value == [1, -1] and "right wheel" in found.text


@pytest.mark.parametrize("world", ["W1", "W4"])
def test_the_other_placement_is_a_warning(world: str) -> None:
    drive = simulate(world, 0.005, 30.0, 302)
    recording, setup = robot(encoder_placement=EncoderPlacement.GROUND)(drive)
    (found,) = faults(recording, setup).values()
    assert found.severity is Severity.WARN and "encoder_placement" in found.sentence


def test_a_wrong_reference_is_distinguished_from_a_wrong_gyro(drive: Simulated) -> None:
    reference = drive.recording.reference
    assert reference is not None
    backward = replace(drive.recording, reference=replace(reference, tilt=-reference.tilt))
    (found,) = faults(backward, drive.setup).values()
    assert "so the reference has the wrong sign" in found.sentence
    recording, setup = gyro(lambda v: -v)(drive)
    assert "the gyro is wrong" in faults(recording, setup)["reference scale"].sentence


def test_clipping_recommends_ranges_with_room(drive: Simulated) -> None:
    recording, setup = robot(gyro_range=1.0, accel_range=11.0)(drive)
    imu = recording.imu
    clipped = replace(imu, gyro=imu.gyro.clip(-1.0, 1.0), accel=imu.accel.clip(-11.0, 11.0))
    found = noteworthy(check(replace(recording, imu=clipped), setup))
    values = {each.parameter: each.value for each in found if each.check == "saturation"}
    assert values["robot.gyro_range"] == pytest.approx(np.radians(1000.0))
    assert values["robot.accel_range"] == pytest.approx(8.0 * 9.80665)


def test_microseconds_for_milliseconds_are_found(drive: Simulated) -> None:
    recording = drive.recording
    imu = replace(recording.imu, stamps=recording.imu.stamps // 1000)
    found = faults(replace(recording, imu=imu, wheels=None, reference=None), drive.setup)
    assert "unit of time" in found["IMU time unit"].sentence


def test_gravity_removed_is_not_gravity_in_g(drive: Simulated) -> None:
    """A median of 0.1 g is one or the other; what gravity leaves behind scatters."""
    imu = drive.recording.imu
    left = imu.accel - [0.0, 0.0, 9.80665]
    left *= 1.0 / float(np.median(np.linalg.norm(left, axis=1)))
    for values, cause in ((left, "gravity was removed"), (imu.accel / 9.80665, "it is in g")):
        recording = replace(drive.recording, imu=replace(imu, accel=values))
        assert cause in faults(recording, drive.setup)["accelerometer unit"].text


def test_a_calibrated_sensor_upside_down_has_the_right_length(drive: Simulated) -> None:
    recording, setup = accelerometer(lambda values: -values)(drive)
    calibration = replace(setup.calibration, accel_bias=(0.0, 0.0, -1.2))
    found = faults(recording, replace(setup, calibration=calibration))
    assert "accelerometer direction" in found
    assert not found.keys() & {"accelerometer unit", "accelerometer gravity"}


def test_wheels_that_stand_still_are_named_with_their_time(drive: Simulated) -> None:
    finding = faults(*wheels(halted)(drive))["wheels rolling"]
    assert "their angles stay the same: encoders or cable are dead there" in finding.text


def test_coarse_wheels_do_not_slip(drive: Simulated) -> None:
    found = faults(*wheels(lambda angle: quantised(angle, 20))(drive))
    assert "wheels resolution" in found and "wheels rolling" not in found


@pytest.mark.parametrize("seconds", [2.5, 5.0])
def test_a_short_recording_shows_its_units(drive: Simulated, seconds: float) -> None:
    kept = drive.recording.imu.stamps < drive.recording.imu.stamps[0] + round(seconds * 1e9)
    imu = drive.recording.imu
    cut = replace(imu, stamps=imu.stamps[kept], gyro=imu.gyro[kept], accel=imu.accel[kept])
    assert "accelerometer unit" not in faults(replace(drive.recording, imu=cut), drive.setup)
    in_g = replace(cut, accel=cut.accel / 9.80665)
    assert "accelerometer unit" in faults(replace(drive.recording, imu=in_g), drive.setup)
    down = replace(cut, accel=-cut.accel)
    assert "accelerometer direction" in faults(replace(drive.recording, imu=down), drive.setup)
