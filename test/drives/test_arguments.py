"""Every public callable, every argument: an error in the argument's words, or the right result."""

from __future__ import annotations

import atexit
import inspect
import math
import re
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import twbr_estimation as twbr
from twbr_estimation.bags import write_recording
from twbr_estimation.filters import filter_named

ANYTHING: dict[str, Any] = {
    "text": "zzz",
    "empty text": "",
    "number in a text": "1",
    "bytes": b"zzz",
    "switch": True,
    "minus one": -1,
    "half": 0.5,
    "nan": math.nan,
    "infinity": math.inf,
    "huge": 1e300,
    "thousands of digits": 10**5000,
    "complex": 1j,
    "None": None,
    "empty list": [],
    "list of texts": ["zzz"],
    "set": {0.1, 0.2, 0.3},
    "mapping": {"zzz": "zzz"},
    "array": np.full((2, 3), 0.1),
    "array of nan": np.full(3, math.nan),
    "function": repr,
    "type": str,
    "object": object(),
}
"""What a person may pass by mistake; each argument takes few of these."""
NUMBERS = ("minus one", "half", "infinity", "huge", "thousands of digits")
TEXTS = ("text", "empty text", "number in a text")


def track(**changes: Any) -> twbr.ImuTrack:
    stamps = np.arange(1, 4) * 10_000_000
    values = {"stamps": stamps, "gyro": np.zeros((3, 3)), "accel": np.full((3, 3), 5.0)}
    return twbr.ImuTrack(**{**values, **changes})


RECORDING = twbr.Recording("mine", track())
DRIVE = twbr.Drive(RECORDING)
REFERENCED = DRIVE.with_reference(twbr.TiltTrack(RECORDING.imu.stamps, np.zeros(3)))
MINE = filter_named("complementary")
AT_REST = {"dt": 0.01, "gyro": (0.0, 0.0, 0.0), "accel": (0.0, 0.0, 9.8)}


def step(**changes: Any) -> Any:
    """Return the second step of an estimator."""
    estimator = twbr.Estimator("kalman")
    estimator.step(**AT_REST)
    return estimator.step(**{**AT_REST, **changes})


@cache
def bag() -> Path:
    """Return a recording of three samples on disk."""
    path = Path(tempfile.mkdtemp()) / "bag"
    atexit.register(shutil.rmtree, path.parent)
    write_recording(path, RECORDING)
    return path


def load(**arguments: Any) -> twbr.Drive:
    return twbr.load(bag(), **arguments)


class Argument(NamedTuple):
    """One argument, and which of `ANYTHING` it takes."""

    name: str
    call: Callable[[Any], Any]
    takes: tuple[str, ...] = ()
    said: str = ""
    """The name in the message, where it is another."""
    slow: tuple[str, ...] = ()
    """What it takes, too, as other tests show."""


STAMPS = RECORDING.imu.stamps
ARGUMENTS = {
    "load": [
        Argument("path", twbr.load, said="path|zzz|recording|1: "),
        Argument("config", lambda v: load(config=v), ("None",), "config|1: |zzz"),
        Argument("preset", lambda v: load(preset=v), ("None",)),
        Argument("terms", lambda v: load(terms=v), ("None", "empty list")),
        Argument("loop_period", lambda v: load(loop_period=v), ("half",)),
        Argument("topics", lambda v: load(topics=v), ("None",)),
        Argument("estimators", lambda v: load(estimators=v), ("None",), "estimators|zzz"),
        Argument("options", lambda v: load(options=v), ("None",)),
        Argument("required", lambda v: load(required=v), ("empty list",)),
    ],
    "simulate": [
        Argument("world", lambda v: twbr.simulate(v, duration=0.1)),
        Argument("seed", lambda v: twbr.simulate(seed=v, duration=0.1)),
        Argument("dt", lambda v: twbr.simulate(dt=v, duration=1.0), ("half",)),
        Argument("duration", lambda v: twbr.simulate(duration=v), ("half",)),
        Argument("scene", lambda v: twbr.simulate(scene=v, duration=0.1)),
    ],
    "Drive": [
        Argument("recording", twbr.Drive),
        Argument("setup", lambda v: twbr.Drive(RECORDING, v)),
        Argument("settings", lambda v: twbr.Drive(RECORDING, settings=v)),
        Argument("options", lambda v: twbr.Drive(RECORDING, options=v)),
        Argument("loop_period", lambda v: twbr.Drive(RECORDING, loop_period=v), ("half",)),
        Argument(
            "notes",
            lambda v: twbr.Drive(RECORDING, notes=v),
            ("text", "empty text", "number in a text", "empty list", "list of texts"),
        ),
    ],
    "Drive.run": [
        Argument("names", DRIVE.run, said="names|there is no filter"),
        Argument("values", lambda v: DRIVE.run("gyro", values=v), ("None",)),
        Argument(
            "values of a filter",
            lambda v: DRIVE.run("gyro", values={"gyro": v}),
            said=r"values|filter gyro has no parameter",
        ),
        Argument(
            "value",
            lambda v: DRIVE.run("complementary", values={"complementary": {"time_constant": v}}),
            ("half",),
            r"complementary\.time_constant",
        ),
        Argument("smooth", lambda v: DRIVE.run("gyro", smooth=v), slow=("switch",)),
        Argument("progress", lambda v: DRIVE.run("gyro", progress=v), ("function", "type")),
    ],
    "Drive.smoothed": [
        Argument("values", DRIVE.smoothed, slow=("None",)),
        Argument("progress", lambda v: DRIVE.smoothed(progress=v), slow=("function", "type")),
    ],
    "Drive.with_setup": [Argument("setup", DRIVE.with_setup)],
    "Drive.with_reference": [Argument("reference", DRIVE.with_reference)],
    "Drive.with_terms": [Argument("terms", DRIVE.with_terms)],
    "Drive.values_of": [
        Argument("values", lambda v: DRIVE.values_of([MINE], v), ("None",)),
    ],
    "Runs.scores": [Argument("options", REFERENCED.run("gyro").scores, ("None",))],
    "Runs.plot": [Argument("axes", DRIVE.run("gyro").plot, ("None",))],
    "read_setup": [Argument("paths", twbr.read_setup, said="paths|zzz|1: |folder|holds none")],
    "read_settings": [
        Argument("paths", twbr.read_settings, said="paths|zzz|1: |folder|holds none")
    ],
    "Estimator": [
        Argument("filter", twbr.Estimator, said="filter"),
        Argument("robot", lambda v: twbr.Estimator("gyro", v), ("None",)),
        Argument("values", lambda v: twbr.Estimator("gyro", values=v), ("None",), "values|zzz"),
    ],
    "Estimator.step": [
        Argument("dt", lambda v: step(dt=v), ("half",)),
        Argument("gyro", lambda v: step(gyro=v)),
        Argument("accel", lambda v: step(accel=v)),
        Argument("wheels", lambda v: step(wheels=v), ("None", "minus one", "half")),
        Argument("motors", lambda v: step(motors=v), ("None", "minus one", "half")),
        Argument(
            "first dt",
            lambda v: twbr.Estimator("gyro").step(**{**AT_REST, "dt": v}),
            ("half",),
            "`dt`",
        ),
    ],
    "Robot": [
        Argument("wheel_radius", lambda v: twbr.Robot(wheel_radius=v), ("half",)),
        Argument("lever_arm", lambda v: twbr.Robot(lever_arm=v)),
        Argument("encoder_placement", lambda v: twbr.Robot(encoder_placement=v)),
    ],
    "Calibration": [
        Argument("gyro_bias", lambda v: twbr.Calibration(gyro_bias=v)),
        Argument("accel_scale_x", lambda v: twbr.Calibration(accel_scale_x=v), ("empty list",)),
        Argument("accel_valid_z", lambda v: twbr.Calibration(accel_valid_z=v)),
        Argument("gyro_noise", lambda v: twbr.Calibration(gyro_noise=v), ("half",)),
    ],
    "CorrectionSettings": [
        Argument("euler", lambda v: twbr.CorrectionSettings(euler=v), ("switch",)),
        Argument(
            "rate_time_constant",
            lambda v: twbr.CorrectionSettings(rate_time_constant=v),
            ("half",),
        ),
        Argument("dt", lambda v: twbr.CorrectionSettings(dt=v), ("half",)),
    ],
    "Setup": [
        Argument("robot", twbr.Setup),
        Argument("calibration", lambda v: twbr.Setup(calibration=v)),
        Argument("correction", lambda v: twbr.Setup(correction=v)),
    ],
    "Settings": [
        Argument("values", twbr.Settings),
        Argument("filter", lambda v: twbr.Settings(filter=v), TEXTS),
        Argument("dt", lambda v: twbr.Settings(dt=v), ("half",)),
        Argument("source", lambda v: twbr.Settings(source=v), TEXTS),
    ],
    "ScoringOptions": [
        Argument(
            "reference_delay",
            lambda v: twbr.ScoringOptions(reference_delay=v),
            ("half", "minus one"),
        ),
        Argument(
            "reference_offset",
            lambda v: twbr.ScoringOptions(reference_offset=v),
            ("half", "minus one"),
        ),
        Argument("skip", lambda v: twbr.ScoringOptions(skip=v), ("half",)),
    ],
    "TopicNames": [
        Argument("imu", lambda v: twbr.TopicNames(imu=v), TEXTS),
        Argument(
            "wheel_joints",
            lambda v: twbr.TopicNames(wheel_joints=v),
            ("text", "number in a text", "list of texts"),
        ),
        Argument("reference_joint", lambda v: twbr.TopicNames(reference_joint=v), TEXTS),
        Argument("stamps", lambda v: twbr.TopicNames(stamps=v)),
    ],
    "Recording": [
        Argument("source", lambda v: twbr.Recording(v, track()), TEXTS),
        Argument("imu", lambda v: twbr.Recording("mine", v)),
        Argument("wheels", lambda v: replace(RECORDING, wheels=v), ("None",)),
        Argument("reference", lambda v: replace(RECORDING, reference=v), ("None",)),
        Argument("motors", lambda v: replace(RECORDING, motors=v), ("None",)),
        Argument("estimators", lambda v: replace(RECORDING, estimators=v)),
        Argument("repairs", lambda v: replace(RECORDING, repairs=v), ("mapping",)),
    ],
    "ImuTrack": [
        Argument("stamps", lambda v: track(stamps=v), said="stamps|gyro"),
        Argument("gyro", lambda v: track(gyro=v)),
        Argument("accel", lambda v: track(accel=v)),
        Argument("frame_id", lambda v: track(frame_id=v), TEXTS),
    ],
    "WheelTrack": [
        Argument("stamps", lambda v: twbr.WheelTrack(v, np.zeros((3, 1))), said="stamps|angle"),
        Argument("angle", lambda v: twbr.WheelTrack(STAMPS, v)),
    ],
    "MotorTrack": [
        Argument("stamps", lambda v: twbr.MotorTrack(v, np.zeros((3, 1))), said="stamps|voltage"),
        Argument("voltage", lambda v: twbr.MotorTrack(STAMPS, v)),
    ],
    "TiltTrack": [
        Argument("stamps", lambda v: twbr.TiltTrack(v, np.zeros(3)), said="stamps|tilt"),
        Argument("tilt", lambda v: twbr.TiltTrack(STAMPS, v), ("array of nan",)),
        Argument("rate", lambda v: twbr.TiltTrack(STAMPS, STAMPS, v), ("None", "array of nan")),
    ],
    "Bounds": [
        Argument("minimum", lambda v: twbr.Bounds(v, 1.0, "s", ""), ("minus one", "half")),
        Argument(
            "maximum",
            lambda v: twbr.Bounds(-2.0, v, "s", ""),
            ("minus one", "half", "infinity", "huge", "thousands of digits"),
        ),
        Argument("unit", lambda v: twbr.Bounds(0.0, 1.0, v, ""), TEXTS),
        Argument("description", lambda v: twbr.Bounds(0.0, 1.0, "s", v), TEXTS),
    ],
    "Filter": [
        Argument("name", lambda v: replace(MINE, name=v), ("text",)),
        Argument("title", lambda v: replace(MINE, title=v), TEXTS),
        Argument("source", lambda v: replace(MINE, source=v), TEXTS),
        Argument("parameters", lambda v: replace(MINE, parameters=v)),
        Argument("state", lambda v: replace(MINE, state=v)),
        Argument("reset", lambda v: replace(MINE, reset=v), ("function", "type")),
        Argument("step", lambda v: replace(MINE, step=v), ("function", "type")),
        Argument("derive", lambda v: replace(MINE, derive=v), ("function", "type")),
    ],
}
NO_ARGUMENTS_CHECKED = {
    "CorrectedSample": "a record of the hot path",
    "TiltEstimate": "a record of the hot path",
    "TwbrError": "an exception",
    "Runs": "made by `Drive.run`",
    "filters": "takes no argument",
}
EVERY = [
    pytest.param(argument, id=f"{owner}-{argument.name}")
    for owner, arguments in ARGUMENTS.items()
    for argument in arguments
]


def outcome(argument: Argument, value: Any) -> str:
    """Return how a call ends: "taken", "refused" in the argument's words, or what is wrong."""
    try:
        argument.call(value)
    except twbr.TwbrError as error:
        fits = re.search(argument.said or argument.name, str(error)) and len(str(error)) < 700
        return "refused" if fits else f"says: {error}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return "taken"


def test_every_public_callable_is_here() -> None:
    callables = {name for name in twbr.__all__ if callable(getattr(twbr, name))}
    assert callables == {name for name in ARGUMENTS if "." not in name} | {*NO_ARGUMENTS_CHECKED}
    for owner, arguments in ARGUMENTS.items():
        kind, _, method = owner.partition(".")
        function = getattr(twbr, kind) if not method else getattr(getattr(twbr, kind), method)
        known = inspect.signature(function).parameters
        assert any(argument.name in known for argument in arguments)


@pytest.mark.parametrize("argument", EVERY)
def test_an_argument_is_taken_or_named(argument: Argument) -> None:
    kinds = [kind for kind in ANYTHING if kind not in argument.slow]
    wanted = {kind: "taken" if kind in argument.takes else "refused" for kind in kinds}
    assert {kind: outcome(argument, ANYTHING[kind]) for kind in kinds} == wanted


@pytest.mark.parametrize(
    "number", [np.float32(0.25), np.float64(0.25), np.array(0.25), Fraction(1, 4), 0.25]
)
def test_a_number_may_be_of_any_type(number: Any) -> None:
    assert twbr.Robot(wheel_radius=number) == twbr.Robot(wheel_radius=0.25)
    assert type(twbr.Robot(wheel_radius=number).wheel_radius) is float
    usual = step(dt=0.25, gyro=(0.25, 0.25, 0.25), wheels=0.25, motors=0.25)
    assert step(dt=number, gyro=[number] * 3, wheels=number, motors=number) == usual
    assert step(dt=number, gyro=np.full(3, number), wheels=[number], motors=(number,)) == usual
    settings = {"complementary": {"time_constant": number}}
    runs = DRIVE.run("complementary", values=settings)
    same = DRIVE.run("complementary", values={"complementary": {"time_constant": 0.25}})
    np.testing.assert_array_equal(runs["complementary"].tilt, same["complementary"].tilt)
    assert twbr.ScoringOptions(skip=number) == twbr.ScoringOptions(skip=0.25)


def test_whole_numbers_may_be_of_any_type() -> None:
    seeds = (3, np.int64(3), np.uint8(3))
    made = [twbr.simulate(seed=seed, dt=0.01, duration=0.1).key for seed in seeds]
    assert made == [made[0]] * 3
    assert step(wheels=np.int32(0)) == step(wheels=0)
    assert step(wheels=np.zeros(2, dtype=np.float32)) == step(wheels=(0, 0))


def test_a_robot_of_lists_and_arrays_is_that_of_tuples() -> None:
    robot = twbr.Robot(lever_arm=np.array([0.0, 0.0, 0.1]), encoder_placement="ground")
    assert robot == twbr.Robot(lever_arm=(0, 0, 0.1), encoder_placement=robot.encoder_placement)
    assert hash(robot) == hash(replace(robot, lever_arm=[0.0, 0.0, 0.1]))


@pytest.mark.parametrize(
    ("argument", "value", "said"),
    [
        ("gyro", (0.0, 1e300, 0.0), "`gyro`: .* the limit is 600 rad/s"),
        ("accel", (0.0, 1e100, 0.0), "`accel`: .* the limit is 2000 m/s"),
        ("wheels", 1e100, "`wheels`: 1e.100 is beyond any sensor: the limit is 1e.07 rad"),
        ("motors", (1e300, 0.0), "`motors`: .* the limit is 1000 V"),
        ("dt", 1e-300, "`dt`: 1e-300 is no number from 1e-09 to 1e.09 s"),
        ("dt", 0.0, "`dt`: 0.0 is no number from 1e-09"),
    ],
)
def test_what_no_sensor_reads_is_refused(argument: str, value: Any, said: str) -> None:
    with pytest.raises(twbr.TwbrError, match=said):
        step(**{argument: value})


@pytest.mark.parametrize("name", list(twbr.filters()))
def test_the_largest_readings_are_taken_by_every_filter(name: str) -> None:
    """The shortest and longest times and the limits of all sensors, from rest and back."""
    estimator = twbr.Estimator(name)
    for dt, sign in ((0.0, 0), (1e-9, 1), (1e-9, -1), (1.0, 1), (0.01, -1), (1e9, 1), (0.01, 0)):
        gyro, accel = (600.0 * sign,) * 3, (2000.0 * sign, 0.0, 2000.0 * sign)
        found = estimator.step(dt, gyro, accel, (1e7 * sign, -1e7 * sign), 1000.0 * sign)
        assert all(map(math.isfinite, found))


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (lambda: track(stamps=np.array([3, 2, 1])), "imu.stamps: not strictly increasing"),
        (lambda: track(gyro=np.full((3, 3), math.nan)), "imu.gyro: a value is not finite"),
        (lambda: track(accel=np.full((3, 3), 1e300)), "imu.accel: a value is not finite, or bey"),
        (lambda: twbr.ImuTrack([], np.zeros((0, 3)), np.zeros((0, 3))), "there is no sample"),
    ],
)
def test_a_recording_that_cannot_be_filtered_is_refused(
    changed: Callable[[], twbr.ImuTrack], said: str
) -> None:
    with pytest.raises(twbr.TwbrError, match=said):
        twbr.Drive(twbr.Recording("mine", changed()))


def test_a_run_is_named_where_it_is_missing() -> None:
    runs = DRIVE.run("gyro")
    for name in ("zzz", 3, None, ["gyro"]):
        with pytest.raises(KeyError, match="was not run; there are: gyro"):
            runs[name]  # type: ignore[index]


@pytest.mark.parametrize("read", [twbr.read_setup, twbr.read_settings])
def test_nothing_to_read_is_not_taken_for_the_defaults(read: Callable[[], Any]) -> None:
    with pytest.raises(twbr.TwbrError, match="`paths`: none is given"):
        read()
