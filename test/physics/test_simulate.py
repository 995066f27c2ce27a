from __future__ import annotations

import math

import numpy as np
import pytest

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.physics import SCENES, simulate
from twbr_estimation.robot import Robot
from twbr_estimation.samples import STANDARD_GRAVITY
from twbr_estimation.sensors.error_model import resolutions
from twbr_estimation.simulation.simulate import Simulated

pytest.importorskip("mujoco", reason="MuJoCo is not installed: extra `physics`")

EXPECTED = {
    "fall": {"lying", "held", "after"},
    "starts_lying": {"lying", "held", "after"},
    "lifted": {"lifted", "after"},
    "carried": {"carried", "after"},
    "carried_running": {"carried", "after"},
    "wall": {"wall", "held", "after"},
    "leaning": {"leaning", "held", "after"},
    "ice": {"ice", "after"},
    "spin": {"spinning", "after"},
    "upside_down": {"carried", "upside down", "after"},
    "dropped": {"held", "airborne", "after"},
}
"""Events that a scene of 20 s must have; the others need none."""


@pytest.fixture(scope="module")
def made() -> dict[str, Simulated]:
    return {name: simulate(name, 0.005, 20.0, 3, world="ideal") for name in SCENES}


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_is_finite_and_has_its_events(made: dict[str, Simulated], name: str) -> None:
    simulated = made[name]
    recording = simulated.recording
    assert recording.imu.stamps.size == 4000
    for values in (recording.imu.gyro, recording.imu.accel, recording.wheels.angle):
        assert np.all(np.isfinite(values))
    names = {event.name for event in simulated.events}
    assert EXPECTED.get(name, set()) <= names
    for event in simulated.events:
        assert recording.imu.stamps[0] <= event.begin < event.end <= recording.imu.stamps[-1]


@pytest.mark.parametrize("name", SCENES)
def test_the_specific_force_is_gravity_in_the_mean(made: dict[str, Simulated], name: str) -> None:
    """Robots come to no great height: the mean force upward is gravity, whatever happens."""
    accel, truth = made[name].recording.imu.accel, made[name].recording.truth
    up = accel[:, 2] * np.cos(truth.tilt) - accel[:, 0] * np.sin(truth.tilt)
    assert np.mean(up) == pytest.approx(STANDARD_GRAVITY, rel=0.03)


@pytest.mark.parametrize("name", SCENES)
def test_the_gyro_is_the_rate_of_the_truth(made: dict[str, Simulated], name: str) -> None:
    """In every scene, carried ones apart, whose other axes turn as well."""
    if name in ("carried", "carried_running", "lifted"):
        pytest.skip("the hand turns the robot about all axes")
    recording = made[name].recording
    error = recording.imu.gyro[:, 1] - recording.truth.rate
    assert np.sqrt(np.mean(error**2)) < 0.02 * (1.0 + np.sqrt(np.mean(recording.truth.rate**2)))


def test_a_seed_gives_the_same_recording_and_another_another() -> None:
    first, again, other = (simulate("lifted", 0.01, 6.0, seed) for seed in (1, 1, 2))
    for one, two in ((first, again), (first, other)):
        same = one is first and two is again
        assert np.array_equal(one.recording.imu.gyro, two.recording.imu.gyro) is same
        assert np.array_equal(one.recording.wheels.angle, two.recording.wheels.angle) is same
    assert first.events == again.events


def test_lying_means_motionless_on_the_ground(made: dict[str, Simulated]) -> None:
    recording, events = made["starts_lying"].recording, made["starts_lying"].events
    (lying,) = (event for event in events if event.name == "lying")
    during = (recording.imu.stamps >= lying.begin) & (recording.imu.stamps < lying.end)
    assert np.all(np.abs(recording.truth.tilt[during]) > 1.2)
    force = np.linalg.norm(recording.imu.accel[during], axis=1)
    np.testing.assert_allclose(force[:-40], STANDARD_GRAVITY, rtol=0.002)


def test_the_wheels_stand_or_run_while_the_robot_is_carried(made: dict[str, Simulated]) -> None:
    for name, least, largest in (("carried", 0.0, 0.01), ("carried_running", 3.0, 1000.0)):
        recording, events = made[name].recording, made[name].events
        carried = next(event for event in events if event.name == "carried")
        stamps = recording.wheels.stamps
        during = (stamps > carried.begin + 10**9) & (stamps < carried.end - 15 * 10**8)
        assert least <= np.ptp(recording.wheels.angle[during][:, 0]) <= largest


def test_the_ranges_are_those_of_the_robot() -> None:
    wide = Robot(gyro_range=math.radians(1000.0), accel_range=8.0 * STANDARD_GRAVITY)
    gyro, accel = resolutions(wide)
    assert math.degrees(gyro) == pytest.approx(4.0 / 131.0) and accel == STANDARD_GRAVITY / 4096.0
    narrow, wider = (simulate("fall", 0.002, 6.0, 1, robot=robot) for robot in (Robot(), wide))
    assert np.abs(narrow.recording.imu.gyro).max() == pytest.approx(math.radians(250.14), rel=1e-3)
    assert np.abs(wider.recording.imu.gyro).max() > math.radians(400.0)
    counts = wider.recording.imu.gyro / gyro
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)


def test_clipping_before_the_low_pass_leaves_no_reading_at_the_limit() -> None:
    marked, hidden = (
        simulate("fall", 0.002, 6.0, 1, world="ideal", clipped_first=first).recording.imu.gyro
        for first in (False, True)
    )
    assert np.abs(marked).max() > math.radians(400.0)  # an ideal world has no limit
    assert np.abs(hidden).max() <= math.radians(250.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("mars",), "there is no scene 'mars' of the physics engine; there are: stand, drive"),
        (("stand", 0.0007), "not a multiple of the step"),
        (("stand", 0.01, 0.01), "below two periods"),
        (("stand", math.nan), "`dt`: nan is no number"),
        (("stand", 0.01, 5.0, -1), "`seed`: -1 is no whole number from 0"),
    ],
)
def test_what_cannot_be_simulated_says_why(arguments: tuple[object, ...], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        simulate(*arguments)  # type: ignore[arg-type]


def test_a_body_that_cannot_be_is_named() -> None:
    with pytest.raises(ConfigurationError, match=r"robot: MuJoCo cannot simulate it: .*inertia"):
        simulate("stand", 0.01, 1.0, 1, robot=Robot(body_inertia=1.0))
