"""When a robot balances and when its motors are cut, without ROS."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import pytest

from twbr_estimation.controllers import Controller, controller_named, controllers
from twbr_estimation.controllers import base as registry
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.pipeline.pairing import wheel_reading
from twbr_estimation.simulation.simulated_robot import SimulatedRobot
from twbr_estimation.streams.control.balance import (
    NO_VOLTAGE,
    BalanceConfiguration,
    BalanceSettings,
)
from twbr_estimation.streams.control.deadline import Deadline
from twbr_estimation.streams.control.motors import (
    ControlConfiguration,
    ControlSettings,
    ControlStream,
)

PERIOD = 5_000_000
START = 10**9


def configured(**settings: object) -> ControlConfiguration:
    own = {
        key: settings.pop(key) for key in ("start_when_upright", "blend_time") if key in settings
    }
    balance = BalanceConfiguration(BalanceSettings(**settings))  # type: ignore[arg-type]
    return ControlConfiguration(ControlSettings(**own), balance)  # type: ignore[arg-type]


class Loop:
    """A robot without sensor errors, and a stream that gets its true tilt."""

    def __init__(self, robot: SimulatedRobot | None = None, **settings: object) -> None:
        self.robot = robot or SimulatedRobot(
            "ideal", 3, 0.005, disturbed=False, stay_down=True, command_delay=0.005
        )
        self.stream = ControlStream(configured(**settings))
        self.voltages = NO_VOLTAGE
        self.given: list[tuple[float, float]] = []
        self.wheels = True

    def run(self, seconds: float, rate: bool = True) -> None:
        for _ in range(round(seconds / 0.005)):
            (reading,) = self.robot.advance(self.voltages, 0.005)
            truth = reading.truth
            if self.wheels:
                self.stream.add_wheels(wheel_reading(reading.stamp, reading.wheels))
            asked = self.stream.add_tilt(reading.stamp, truth.tilt, truth.rate if rate else None)
            self.voltages = asked if asked is not None else self.voltages
            self.given.append(tuple(self.voltages))


@pytest.fixture
def loop() -> Loop:
    made = Loop()
    made.run(1.0)
    assert made.stream.cut_because == ""
    return made


@pytest.mark.parametrize("controller", list(controllers()))
@pytest.mark.parametrize("rate", [True, False], ids=["rate measured", "rate derived"])
def test_every_controller_balances(controller: str, rate: bool) -> None:
    loop = Loop(controller=controller)
    loop.run(3.0, rate)
    loop.robot.push(4.0)
    loop.run(5.0, rate)
    assert loop.robot.falls == 0
    assert abs(loop.robot.truth.tilt) < 0.05


def test_it_waits_until_the_robot_is_stood_up() -> None:
    loop = Loop()
    loop.robot.place(0.6)
    loop.run(0.5)
    assert loop.robot.held and set(loop.given) == {NO_VOLTAGE}
    assert loop.stream.cut_because == "fallen"
    loop.robot.place(0.02)
    loop.run(2.0)
    assert loop.stream.cut_because == ""
    assert abs(loop.robot.truth.tilt) < 0.05


def test_a_fall_cuts_at_once_and_until_it_is_stood_up(loop: Loop) -> None:
    loop.robot.push(60.0)
    while abs(loop.robot.truth.tilt) <= 0.6:
        loop.run(0.005)
        assert loop.robot.time < 5.0
    assert loop.voltages == NO_VOLTAGE
    assert loop.stream.counts["falls"] == 1
    loop.run(2.0)
    assert loop.voltages == NO_VOLTAGE and loop.stream.cut_because == "fallen"
    assert loop.stream.counts["falls"] == 1
    loop.robot.place(0.02)
    loop.run(3.0)
    assert loop.stream.cut_because == "" and loop.robot.falls == 1


def test_being_carried_past_upright_is_not_being_stood_up() -> None:
    loop = Loop(recovery_time=0.2)
    for tilt in (0.5, 0.3, 0.05, -0.3, 0.05, 0.3):
        loop.robot.place(tilt)
        loop.run(0.02)
        assert loop.voltages == NO_VOLTAGE


def test_without_start_when_upright_only_enable_starts_it() -> None:
    loop = Loop(start_when_upright=False)
    loop.run(0.1)
    loop.robot.place(0.0)
    loop.run(0.3)
    assert loop.stream.cut_because.startswith("disabled")
    loop.robot.place(0.0)
    assert loop.stream.enable() == "enabled"
    loop.run(2.0)
    assert loop.stream.cut_because == ""
    loop.robot.push(60.0)
    loop.run(2.0)
    loop.robot.place(0.01)
    loop.run(0.3)
    assert loop.stream.cut_because.startswith("disabled")


def test_enable_on_a_robot_that_lies_waits_for_it_to_be_stood_up(loop: Loop) -> None:
    loop.stream.disable()
    loop.robot.push(5.0)
    loop.run(2.0)
    assert loop.voltages == NO_VOLTAGE and loop.robot.held
    assert "as soon as it is stood up" in loop.stream.enable()
    loop.run(0.5)
    assert loop.voltages == NO_VOLTAGE
    loop.robot.place(0.01)
    loop.run(2.0)
    assert loop.stream.cut_because == "" and abs(loop.robot.truth.tilt) < 0.05


def test_an_invalid_tilt_cuts_and_balancing_goes_on_after(loop: Loop) -> None:
    loop.stream.set_valid(False)
    loop.run(0.05)
    assert loop.voltages == NO_VOLTAGE and loop.stream.cut_because == "tilt is not valid"
    loop.stream.set_valid(True)
    loop.run(2.0)
    assert loop.stream.cut_because == "" and loop.robot.falls == 0


def test_a_fall_after_another_cut_is_said_to_be_its_consequence(loop: Loop) -> None:
    assert loop.stream.fell_because == ""
    loop.stream.set_valid(False)
    loop.robot.push(60.0)
    loop.run(2.0)
    loop.stream.set_valid(True)
    loop.run(0.1)
    assert loop.stream.cut_because == "fallen"
    assert loop.stream.fell_because == "tilt is not valid"
    loop.robot.place(0.01)
    loop.run(2.0)
    assert loop.stream.cut_because == loop.stream.fell_because == ""
    loop.stream.disable()
    loop.robot.push(60.0)
    loop.run(2.0)
    loop.stream.enable()
    loop.run(0.1)
    assert loop.stream.cut_because == "fallen" and loop.stream.fell_because == ""
    loop.robot.place(0.01)
    loop.run(2.0)
    loop.robot.push(60.0)
    loop.run(2.0)
    assert loop.stream.cut_because == "fallen" and loop.stream.fell_because == ""


def test_silence_cuts(loop: Loop) -> None:
    last = loop.stream.last_tilt
    assert last is not None
    assert loop.stream.tick(last + 50_000_000) is None
    assert loop.stream.tick(last + 51_000_000) == NO_VOLTAGE
    assert loop.stream.cut_because == "tilt is late"


def test_wheels_that_stop_cut(loop: Loop) -> None:
    loop.wheels = False
    loop.run(0.09)
    assert loop.stream.cut_because == ""
    loop.run(0.02)
    assert loop.voltages == NO_VOLTAGE and loop.stream.cut_because == "wheels are late"


def test_numbers_that_are_none_are_not_used(loop: Loop) -> None:
    stamp = loop.stream.last_tilt
    assert stamp is not None
    for tilt, rate in ((math.nan, 0.0), (0.0, math.inf), (math.nan, None)):
        stamp += PERIOD
        assert loop.stream.add_tilt(stamp, tilt, rate) is None
    assert loop.stream.guard.counts["not_finite"] == 3


@pytest.fixture
def broken(monkeypatch: pytest.MonkeyPatch) -> Iterator[Controller]:
    """A controller that asks for NaN as soon as the robot leans."""
    pid = controller_named("pid")

    def step(state, now, coefficients):  # type: ignore[no-untyped-def]
        asked = pid.step(state, now, coefficients)
        return asked._replace(left=math.nan) if abs(now.tilt) > 1e-3 else asked

    entry = replace(pid, name="broken", step=step)
    found = {**controllers(), "broken": entry}
    monkeypatch.setattr(registry, "controllers", lambda: found)
    return entry


@pytest.mark.usefixtures("broken")
def test_voltages_that_are_no_numbers_cut() -> None:
    loop = Loop(controller="broken")
    loop.run(1.0)
    loop.robot.push(3.0)
    loop.run(1.0)
    assert all(math.isfinite(left + right) for left, right in loop.given)
    assert loop.stream.counts["not_finite_voltages"] == 1
    assert loop.voltages == NO_VOLTAGE
    assert loop.stream.cut_because == "fallen"


def test_a_step_is_due_once_a_period_on_average() -> None:
    stream = ControlStream(configured(period=0.005))
    steps = 0
    for index in range(1000):
        stamp = START + index * 2_000_000
        stream.add_wheels(wheel_reading(stamp, [0.0]))
        steps += stream.add_tilt(stamp, 0.0, 0.0) is not None
    assert 399 <= steps <= 401  # 2 s of 5 ms


def test_a_change_of_gains_does_not_jump(loop: Loop) -> None:
    """Under a steady lean, where other gains ask for very different voltages."""
    stream, stamp = loop.stream, START + 10**12
    lean = 0.0

    def step() -> tuple[float, float]:
        nonlocal stamp
        stamp += PERIOD
        stream.add_wheels(wheel_reading(stamp, [0.0]))
        asked = stream.add_tilt(stamp, lean, 0.0)
        assert asked is not None and stream.cut_because == ""
        return asked

    stream.add_wheels(wheel_reading(stamp, [0.0]))
    stream.add_tilt(stamp, lean, 0.0)
    for _ in range(40):
        step()
    lean = 0.05
    before = [step() for _ in range(40)][-1]
    stiff = {"pid": {"tilt_gain": 150.0}}
    stream.configure(ControlConfiguration(balance=BalanceConfiguration(parameters=stiff)))
    after = [step() for _ in range(80)]
    change = abs(after[-1][0] - before[0])
    assert change > 3.0
    jumps = [abs(b[0] - a[0]) for a, b in zip([before, *after], after, strict=False)]
    assert max(jumps) < 0.1 * change


def test_a_change_that_is_refused_changes_nothing(loop: Loop) -> None:
    wrong = BalanceConfiguration(parameters={"pid": {"tilt_gain": -1.0}})
    with pytest.raises(ConfigurationError, match="tilt_gain"):
        loop.stream.configure(ControlConfiguration(balance=wrong))
    loop.run(1.0)
    assert loop.stream.cut_because == ""


def test_a_command_drives_the_robot_and_a_forgotten_one_stops_it(loop: Loop) -> None:
    for _ in range(20):
        loop.stream.command(loop.robot.stamp, 0.2, 0.0)
        loop.run(0.1)
    assert loop.robot.truth.velocity == pytest.approx(0.2, abs=0.05)
    loop.run(4.0)
    assert loop.robot.truth.velocity == pytest.approx(0.0, abs=0.05)
    assert loop.robot.falls == 0


def test_a_clock_that_was_set_back_begins_afresh(loop: Loop) -> None:
    now = loop.stream.last_tilt
    assert now is not None and loop.voltages is not None
    earlier = now - 1_500_000_000
    loop.stream.add_wheels(wheel_reading(earlier, [0.0]))
    assert loop.stream.add_tilt(earlier, 0.3, 0.0) == NO_VOLTAGE
    for index in range(1, 100):
        loop.stream.add_wheels(wheel_reading(earlier + index * PERIOD, [0.0]))
        asked = loop.stream.add_tilt(earlier + index * PERIOD, 0.05, 0.0)
        assert (asked == NO_VOLTAGE) == (index * 0.005 < 0.105), index


class Fed:
    """A stream that is fed by hand: a steady lean that trembles, with the stamps given."""

    def __init__(self, **control: object) -> None:
        chosen = ControlSettings(**control)  # type: ignore[arg-type]
        self.stream = ControlStream(ControlConfiguration(chosen))
        self.now = 1_700_000_000 * START
        self.given: list[tuple[float, float]] = []

    def run(
        self, count: int, age: int = 0, tremble: float = 1e-6, rate: float | None = 0.0
    ) -> list[tuple[float, float]]:
        """Feed samples `age` [ns] old by the clock; return the commands of these steps."""
        given = []
        for index in range(count):
            self.now += PERIOD
            stamp = self.now - age
            self.stream.add_wheels(wheel_reading(stamp, [0.0]))
            asked = self.stream.add_tilt(stamp, 0.05 + tremble * (index % 2), rate, self.now)
            given += [] if asked is None else [tuple(asked)]
        return given

    def driven(self) -> None:
        """Let it balance."""
        assert self.run(40)[-1] != NO_VOLTAGE and self.stream.cut_because == ""


@pytest.mark.parametrize(
    ("age", "because"),
    [
        (1_000_000_000, "stale"),
        (60_000_000, "stale"),
        (-1_000_000_000, "another clock"),
        (10**17, "another clock"),
        (-(10**17), "another clock"),
    ],
)
def test_a_tilt_that_is_not_of_now_cuts_at_once(age: int, because: str) -> None:
    fed = Fed()
    fed.driven()
    given = fed.run(60, age)
    # Of stamps that go back a single one counts as late and is left out.
    assert set(given) == {NO_VOLTAGE} and len(given) > 30
    assert because in fed.stream.cut_because


def test_after_a_long_interruption_it_must_be_stood_up() -> None:
    fed = Fed()
    fed.driven()
    fed.run(40, 60_000_000)
    again = fed.run(40)
    upright = [index for index, each in enumerate(again) if each != NO_VOLTAGE]
    assert upright and 18 <= upright[0] <= 26  # `recovery_time` of 0.1 s


def test_a_pause_in_which_the_process_was_stopped_is_an_interruption() -> None:
    fed = Fed()
    fed.driven()
    fed.now += 300_000_000  # no `tick` meanwhile
    again = fed.run(40)
    upright = [index for index, each in enumerate(again) if each != NO_VOLTAGE]
    assert upright and 18 <= upright[0] <= 26  # `recovery_time` of 0.1 s


def test_a_backlog_after_a_pause_is_no_proof_that_the_robot_stands() -> None:
    fed = Fed()
    fed.driven()
    paused = fed.now
    fed.now += 500_000_000
    assert fed.stream.tick(fed.now) == NO_VOLTAGE
    for stamp in range(paused + PERIOD, fed.now, PERIOD):  # what waited meanwhile
        fed.stream.add_wheels(wheel_reading(stamp, [0.0]))
        asked = fed.stream.add_tilt(stamp, 0.05 + 1e-6 * (stamp % 2), 0.0, fed.now)
        assert asked in (None, NO_VOLTAGE), fed.stream.cut_because
    again = [each != NO_VOLTAGE for each in fed.run(40)]
    assert again.index(True) >= 8  # the last tilts of the backlog are fresh, too


def test_a_short_pause_is_none() -> None:
    fed = Fed()
    fed.driven()
    fed.now += 60_000_000
    assert fed.run(2)[-1] != NO_VOLTAGE


def test_after_a_short_interruption_it_goes_on() -> None:
    fed = Fed()
    fed.driven()
    fed.stream.set_valid(False)
    assert set(fed.run(15)) == {NO_VOLTAGE}
    fed.stream.set_valid(True)
    assert fed.run(2)[-1] != NO_VOLTAGE
    fed.stream.set_valid(False)
    fed.run(30)
    fed.stream.set_valid(True)
    assert set(fed.run(15)) == {NO_VOLTAGE}


@pytest.mark.parametrize("rate", [0.0, None], ids=["rate measured", "rate derived"])
def test_a_frozen_tilt_cuts_within_its_timeout(rate: float | None) -> None:
    fed = Fed()
    fed.driven()
    given = fed.run(200, tremble=0.0, rate=rate)
    last = max(index for index, each in enumerate(given) if each != NO_VOLTAGE)
    assert last * 0.005 <= 0.05 + 2 * 0.005 and "frozen" in fed.stream.cut_because
    fed.run(60)
    assert fed.stream.cut_because == ""


def test_a_frozen_tilt_may_be_allowed() -> None:
    fed = Fed(expect_change=False)
    fed.driven()
    assert fed.run(200, tremble=0.0)[-1] != NO_VOLTAGE


def test_without_a_clock_nothing_is_driven() -> None:
    stream = ControlStream(ControlConfiguration())
    for index in range(100):
        stamp = START + index * PERIOD
        stream.add_wheels(wheel_reading(stamp, [0.0]))
        assert stream.add_tilt(stamp, 0.05 + 1e-6 * index, 0.0, 0) == NO_VOLTAGE
    assert "/clock" in stream.cut_because


def test_a_deadline_is_kept_by_any_watcher() -> None:
    deadline = Deadline(lambda: 0.05)
    assert deadline.check(10.0)[0] is False  # nothing runs
    deadline.feed(10.0)
    deadline.running = True
    due, sleep = deadline.check(10.02)
    assert not due and sleep == pytest.approx(0.03)
    assert deadline.check(10.051)[0] and deadline.missed == 1
    assert deadline.check(10.1)[0] and deadline.missed == 1  # again, in case one got lost
    deadline.feed(10.2)
    assert not deadline.check(10.21)[0]
    assert not deadline.check(10.5)[0]  # zeros since: nothing to cut
