"""Encoders: unwrapping, scale, sign, zero, index and velocity."""

from __future__ import annotations

import math
from typing import Any

import pytest

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.sensors.encoder import CountVelocity, Encoder, EncoderSettings, unwrapped
from twbr_estimation.sensors.joint_encoders import (
    CounterSource,
    JointEncoderSettings,
    Role,
    open_encoders,
)
from twbr_estimation.sensors.motion import swing_tilt
from twbr_estimation.sensors.simulated_counter import SimulatedCounter

SETTINGS = EncoderSettings(counts_per_turn=1000, gear_ratio=4.0)


def _run(encoder: Encoder, clock: Any, seconds: float, period: float = 0.002) -> list[Any]:
    readings = []
    for _ in range(round(seconds / period)):
        clock.advance(period)
        readings.append(encoder.read(clock()))
    return readings


@pytest.mark.parametrize("modulus", [0, 1000, 256, 65536, 2**64])
@pytest.mark.parametrize("speed", [20.0, -20.0])
def test_the_angle_is_followed_through_every_wrap(clock: Any, modulus: int, speed: float) -> None:
    start = clock() * 1e-9
    counter = SimulatedCounter(clock, lambda t: speed * (t - start), SETTINGS, modulus)
    encoder = Encoder(counter, SETTINGS)
    last = _run(encoder, clock, 3.0)[-1]
    # One count, and what a double holds of the seconds since 1970 (0.24 us).
    assert last.position == pytest.approx(
        speed * 3.0, abs=1.01 * SETTINGS.angle_per_count + abs(speed) * 5e-7
    )


def test_unwrapping_takes_the_shorter_way() -> None:
    assert unwrapped(65535, 65536) == -1
    assert unwrapped(-65535, 65536) == 1
    assert unwrapped(100, 65536) == 100
    assert unwrapped(-70000, 0) == -70000


def test_gear_and_counts_give_the_angle_of_the_joint() -> None:
    assert SETTINGS.angle_per_count * 4000 == pytest.approx(2.0 * math.pi)


def test_the_sign_turns_the_joint_around(clock: Any) -> None:
    start = clock() * 1e-9
    counter = SimulatedCounter(clock, lambda t: t - start, SETTINGS)
    assert _run(Encoder(counter, SETTINGS, sign=-1), clock, 1.0)[-1].position < -0.99
    with pytest.raises(ConfigurationError, match="sign: 2"):
        Encoder(counter, SETTINGS, sign=2)


def test_the_present_position_can_be_named(clock: Any) -> None:
    start = clock() * 1e-9
    counter = SimulatedCounter(clock, lambda t: t - start, SETTINGS)
    encoder = Encoder(counter, SETTINGS, start=0.25)
    assert encoder.read(clock()).position == 0.25
    _run(encoder, clock, 1.0)
    encoder.set_angle(-0.5)
    assert encoder.read(clock()).position == pytest.approx(-0.5)


def test_the_first_index_sets_the_zero(clock: Any) -> None:
    settings = EncoderSettings(counts_per_turn=1000, use_index=True)
    start = clock() * 1e-9
    counter = SimulatedCounter(clock, lambda t: 1.0 - (t - start), settings)
    encoder = Encoder(counter, settings, start=5.0)
    assert not encoder.indexed
    assert encoder.read(clock()).position == 5.0
    last = _run(encoder, clock, 1.5)[-1]
    assert encoder.indexed
    assert last.position == pytest.approx(-0.5, abs=1.1 * settings.angle_per_count)


def test_counts_lost_in_a_turn_are_found_at_the_next_index(clock: Any) -> None:
    settings = EncoderSettings(counts_per_turn=1000, use_index=True)
    start = clock() * 1e-9
    turn = 2.0 * math.pi
    counter = SimulatedCounter(clock, lambda t: turn * (t - start - 0.5), settings)
    encoder = Encoder(counter, settings)
    _run(encoder, clock, 1.0)
    counter.lose(30)
    before = _run(encoder, clock, 0.2)[-1]
    assert before.position == pytest.approx(turn * 0.7 - 30 * turn / 1000, abs=0.01)
    after = _run(encoder, clock, 0.6)[-1]
    assert encoder.lost_counts == 30
    assert after.position == pytest.approx(turn * 1.3, abs=0.01)


def test_a_device_that_zeroes_itself_at_the_index_is_absolute(clock: Any) -> None:
    settings = EncoderSettings(counts_per_turn=1000, use_index=True)

    class Zeroing:
        modulus = 2**32
        errors = 0
        zeroed_by_index = True
        count = 700

        def read(self) -> int:
            return self.count

        def index(self) -> None:
            return None

        def close(self) -> None: ...

    counter = Zeroing()
    encoder = Encoder(counter, settings)
    _run(encoder, clock, 0.1)
    counter.count = 0
    reading = _run(encoder, clock, 0.002)[-1]
    assert reading.position == 0.0
    assert reading.velocity == 0.0, "the jump at the index is no motion"
    counter.count = 2**32 - 10
    assert _run(encoder, clock, 0.002)[-1].position == pytest.approx(-10 * settings.angle_per_count)


@pytest.mark.parametrize("speed", [0.05, 0.4, 3.0, 30.0, -3.0])
def test_velocity_is_right_from_crawling_to_running(clock: Any, speed: float) -> None:
    start = clock() * 1e-9
    counter = SimulatedCounter(clock, lambda t: speed * (t - start), SETTINGS)
    encoder = Encoder(counter, SETTINGS)
    velocities = [reading.velocity for reading in _run(encoder, clock, 4.0)][1000:]
    assert sum(velocities) / len(velocities) == pytest.approx(speed, rel=0.03)
    # Quantisation: one count in the window, or the spacing of counts to one poll.
    error = max(abs(velocity - speed) for velocity in velocities)
    count_rate = abs(speed) / SETTINGS.angle_per_count
    limit = max(
        SETTINGS.angle_per_count / SETTINGS.velocity_window, abs(speed) * count_rate * 0.004
    )
    assert error <= min(limit, 1.2 * SETTINGS.angle_per_count / SETTINGS.velocity_window)


def test_velocity_decays_when_the_wheel_stops_and_starts_softly() -> None:
    velocity = CountVelocity(0.02)
    for tick in range(100):
        velocity.update(tick * 2_000_000, tick * 5)
    assert velocity.update(200_000_000, 495) == pytest.approx(500.0)  # not a count for 2 ms
    assert velocity.update(298_000_000, 495) == pytest.approx(10.0)
    assert velocity.update(10_198_000_000, 495) == pytest.approx(0.1)
    # The first count after a rest says only that it took so long.
    assert velocity.update(10_200_000_000, 496) == pytest.approx(0.1, rel=0.01)
    assert velocity.update(10_202_000_000, 497) == pytest.approx(500.0)


def test_velocity_survives_a_clock_that_is_set_back() -> None:
    velocity = CountVelocity(0.02)
    for tick in range(20):
        velocity.update(10**18 + tick * 2_000_000, tick)
    assert velocity.update(10**17, 20) == 0.0
    assert velocity.update(10**17 + 2_000_000, 21) == pytest.approx(500.0)


@pytest.mark.parametrize(("name", "value"), [("counts_per_turn", 0), ("gear_ratio", 0.0)])
def test_settings_without_meaning_are_refused(name: str, value: float) -> None:
    with pytest.raises(ConfigurationError, match=name):
        EncoderSettings(**{name: value})


def test_a_simulated_reference_is_zero_when_upright() -> None:
    clock = 300_000_000
    settings = JointEncoderSettings(
        role=Role.REFERENCE, simulated=True, encoder=EncoderSettings(counts_per_turn=2000)
    )
    (encoder,) = open_encoders(settings, lambda: clock)
    assert encoder.read(clock).position == pytest.approx(swing_tilt(0.3), abs=0.004)


def test_simulated_wheels_turn_together_whatever_the_signs_of_the_robot(clock: Any) -> None:
    settings = JointEncoderSettings(simulated=True, signs=(1, -1))
    left, right = open_encoders(settings, clock)
    turns = [_run(each, clock, 0.3)[-1].position for each in (left, right)]
    assert turns[0] != 0.0
    again = [each.read(clock()).position for each in (left, right)]
    assert again[0] == again[1]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"joint_names": ("a", "a")}, "joint_names: .*a name of its own"),
        ({"joint_names": ("a", "")}, "joint_names: .*a name of its own"),
        ({"signs": (1,)}, "signs: 1 given, 2 needed"),
        ({"signs": (1, -1, 1)}, "signs: 3 given, two encoders have 2"),
        ({"source": CounterSource.GPIO, "gpio_lines": (1, 2, 3, 4, 5)}, "gpio_lines: 5 given"),
    ],
)
def test_lists_of_another_length_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        JointEncoderSettings(**changes)
