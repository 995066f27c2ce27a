"""Parts of the navigation filter, each where its answer is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twbr_estimation.filters import filter_named
from twbr_estimation.filters.inertial.aiding import (
    ROOM_PERIOD,
    begin_aiding,
    drift_noise,
    fading_time,
    watched,
    whole_turns_less,
)
from twbr_estimation.filters.inertial.beginning import (
    begin,
    carried,
    pulled_away,
    unrepaired,
    with_repair,
)
from twbr_estimation.filters.inertial.clipping import (
    begin_clipping,
    clipped,
    rate_of_wheels,
    spun_variance,
    unseen_turn,
)
from twbr_estimation.filters.inertial.error_state import (
    ATTITUDE,
    GYRO_BIAS,
    GYRO_GAIN,
    STATES,
    VELOCITY,
)
from twbr_estimation.filters.inertial.first_wheel_check import first_checked, passed_first
from twbr_estimation.filters.inertial.gravity import (
    begin_gravity,
    factor_of,
    scale_variance,
    weighed,
)
from twbr_estimation.filters.inertial.learnt import (
    begin_memory,
    learnt_by,
    recalled,
    remembered,
    strangeness,
)
from twbr_estimation.filters.inertial.navigation import (
    LONGEST_HELD,
    Navigation,
    integrate,
    read,
)
from twbr_estimation.filters.inertial.parameters import Parameters, derive
from twbr_estimation.filters.inertial.restart import (
    begin_navigation,
    first_covariance,
    next_covariance,
)
from twbr_estimation.filters.inertial.stillness import begin_stillness, is_still, noticed
from twbr_estimation.filters.inertial.strapdown import (
    Vector,
    attitude_at,
    matrix_of,
    rotated,
    unit,
)
from twbr_estimation.filters.inertial.vertical import (
    BIAS_AGREEMENT,
    CREEP,
    GAIN_SHARE,
    MEMORY,
    Vertical,
    agreed,
    at_rest,
    begin_vertical,
    contradicts_rest,
    followed,
    leaning_variance,
    levelling,
    unknown_bias,
    variance_of,
)
from twbr_estimation.filters.inertial.wheel_check import (
    RELAPSE_FACTOR,
    begin_check,
    believed,
    checked,
    condemned,
)
from twbr_estimation.robot import EncoderPlacement, Robot
from twbr_estimation.samples import STANDARD_GRAVITY, CorrectedSample, TiltEstimate
from twbr_estimation.simulation import simulate

LEVEL = matrix_of((1.0, 0.0, 0.0, 0.0))
DT = 0.005
READ_ANEW = (0.0, 0.0)
"""Gyro and accelerometer that read something new at each sample."""


def sample(**readings: float) -> CorrectedSample:
    """Return a sample of a level body at rest, with some readings replaced."""
    zeros = dict.fromkeys(CorrectedSample._fields, 0.0)
    return CorrectedSample(**{**zeros, "dt": DT, "accel_z": STANDARD_GRAVITY, **readings})


@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_two_wheels_show_the_yaw_rate_beyond_the_range(tilt: float) -> None:
    yaw, share, body = 10.0, 0.25, matrix_of(attitude_at(tilt, (0.0, 0.0, 1.0)))
    before = begin_clipping(sample())
    turned = {"wheel_difference": yaw * DT / share, "wheel_count": 2.0}
    reading = sample(gyro_x=-yaw * math.sin(tilt), gyro_z=4.4, **turned)
    assert rate_of_wheels(before, reading, body, share) == pytest.approx(yaw * math.cos(tilt))


@pytest.mark.parametrize(("difference", "count"), [(-0.2, 2.0), (0.01, 2.0), (0.2, 1.0)])
def test_wheels_that_turn_less_or_the_other_way_show_none(difference: float, count: float) -> None:
    reading = sample(gyro_z=4.4, wheel_difference=difference, wheel_count=count)
    assert rate_of_wheels(begin_clipping(sample()), reading, LEVEL, 0.25) == 4.4


def test_the_sooner_a_rate_grew_the_more_is_hidden_beyond_the_range() -> None:
    hidden = []
    for acceleration in (50.0, 600.0):
        clipping, rate, variance = begin_clipping(sample()), 0.0, 0.0
        for _ in range(round(4.0 / acceleration / DT) + 8):
            now = min(rate + acceleration * DT, 4.36)
            flag = 1.0 if now == 4.36 else 0.0
            reading = sample(gyro_y=now, gyro_saturated_y=flag)
            clipping = clipped(clipping, rate, reading)
            variance += unseen_turn(clipping, reading, LEVEL)
            rate = now
        hidden.append(variance)
    assert hidden[1] > 2.0 * hidden[0] > 0.0


@pytest.mark.parametrize(("lean", "seconds", "unknown"), [(0.1, 0.5, True), (0.1, 0.05, False)])
def test_a_hidden_turn_about_the_vertical_leaves_a_lean_unknown_for_a_while(
    lean: float, seconds: float, unknown: bool
) -> None:
    clipping, body = begin_clipping(sample()), matrix_of(attitude_at(lean, (0.0, 0.0, 1.0)))
    for _ in range(round(seconds / DT)):
        clipping = clipped(clipping, 0.0, sample(gyro_z=4.4, gyro_saturated_z=1.0))
    known = [spun_variance(clipping, body, wheels) for wheels in (0.0, 1.0)]
    assert (known[0] > known[1] > lean * lean) is unknown
    assert spun_variance(clipping, LEVEL, 0.0) == 0.0
    for _ in range(round(seconds / DT)):
        clipping = clipped(clipping, 0.0, sample())
    assert spun_variance(clipping, body, 0.0) == 0.0


def test_an_encoder_on_the_body_counts_no_turn_that_the_tilt_makes_at_180_deg() -> None:
    on_body, on_ground = (
        derive(Parameters(), Robot(wheel_radius=0.04, encoder_placement=placement)).geometry
        for placement in (EncoderPlacement.BODY, EncoderPlacement.GROUND)
    )
    turn = 2.0 * math.pi * 0.04
    assert whole_turns_less(turn + 0.01, on_body) == pytest.approx(0.01)
    assert whole_turns_less(turn + 0.01, on_ground) == turn + 0.01
    assert whole_turns_less(-0.05, on_body) == pytest.approx(-0.05)


def test_the_velocity_is_unknown_where_wheels_come_back() -> None:
    """While they were ignored it may have run away further than it says."""
    made, entry = simulate("W4", DT, 12.0, 4001), filter_named("ins_odometer")
    coefficients = entry.derive(entry.configure(), made.setup.robot)
    samples = [CorrectedSample(*each) for each in made.drive.corrected.columns.T.tolist()]
    state = entry.reset(TiltEstimate(samples[0].angle, samples[0].gyro_y), samples[0], coefficients)
    known = []
    for time, reading in zip(np.arange(1, len(samples)) * DT, samples[1:], strict=True):
        if time == 4.0:
            state = state._replace(check=condemned(state.check))
        before, state = state, entry.step(state, reading, coefficients)
        if time > 4.0 and before.aiding.wheels == 0.0 < state.aiding.wheels:
            known.append(state.covariance[3, 3] - before.covariance[3, 3])
    assert known and known[0] > 0.5


@pytest.mark.parametrize("axis", ["gyro_saturated_y", "accel_saturated_x"])
def test_a_clipped_reading_is_no_rest_however_unsure_it_is(axis: str) -> None:
    quiet = (0.0, 0.0, 0.0)
    stillness = begin_stillness(sample())
    for _ in range(200):
        stillness = noticed(stillness, sample(), READ_ANEW)
    hit = sample(gyro_y=4.36, gyro_variance_y=100.0, accel_variance_x=100.0)._replace(**{axis: 1.0})
    assert is_still(stillness, quiet, False, 0.0)
    assert not is_still(noticed(stillness, hit, READ_ANEW), quiet, False, 0.0)


@pytest.mark.parametrize(("gap", "rests"), [(DT, True), (0.4, False)])
def test_a_silence_is_no_rest(gap: float, rests: bool) -> None:
    quiet = (0.0, 0.0, 0.0)
    stillness = begin_stillness(sample())
    for index in range(200):
        reading = sample(dt=gap) if index == 199 else sample()
        stillness = noticed(stillness, reading, READ_ANEW)
    assert is_still(stillness, quiet, False, 0.0) is rests


@pytest.mark.parametrize("factor", [1.0, 0.999])
def test_a_reading_is_known_to_be_held_also_where_it_is_scaled_meanwhile(factor: float) -> None:
    nav = begin_navigation((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    first = sample(gyro_y=0.3, accel_x=1.0)
    now = read(nav, (0.0, 0.3, 0.0), first, READ_ANEW)
    scaled = {axis: factor * getattr(first, axis) for axis in ("accel_x", "accel_y", "accel_z")}
    for count in range(1, 40):
        nav, now = integrate(nav, now, first._replace(**scaled), (0.0, 0.0, 0.0), 1.0)
        assert now.held == pytest.approx((min(count * DT, LONGEST_HELD),) * 2)
    _, now = integrate(nav, now, sample(gyro_y=0.3, accel_x=1.1), (0.0, 0.0, 0.0), 1.0)
    assert now.held == (LONGEST_HELD, 0.0)


@pytest.mark.parametrize("tilt", [0.0, 1.2])
def test_the_gain_of_an_accelerometer_is_that_along_the_vertical(tilt: float) -> None:
    gravity, body = begin_gravity(1.0), matrix_of(attitude_at(tilt, (0.0, 0.0, 1.0)))
    force = 1.035 * STANDARD_GRAVITY
    reading = sample(accel_x=-force * math.sin(tilt), accel_z=force * math.cos(tilt))
    for _ in range(round(60.0 / DT)):
        gravity = weighed(gravity, reading, body)
    assert gravity.gain == pytest.approx(1.035, abs=0.003)


@pytest.mark.parametrize(("gain", "deviation"), [(1.0, 0.0), (0.93, 0.0), (0.5, 1.68), (2.0, 3.68)])
def test_an_accelerometer_of_another_scale_is_doubted(gain: float, deviation: float) -> None:
    gravity = begin_gravity(gain)
    assert scale_variance(gravity) == pytest.approx(deviation**2)
    assert 0.9 < factor_of(gravity) < 1.1


@pytest.mark.parametrize("force", [1.0, 60.0])
def test_falls_and_impacts_say_nothing_of_the_gain_of_an_accelerometer(force: float) -> None:
    assert weighed(begin_gravity(1.0), sample(accel_z=force), LEVEL) == begin_gravity(1.0)


def test_a_bias_that_wheels_pull_along_is_not_opened_without_bound() -> None:
    """Its variance would grow as fast as it is corrected, and nothing would contradict it."""
    assert drift_noise(1e-4, 0.01) == 0.0
    assert drift_noise(2e-3, 0.01) > 0.0
    assert drift_noise(0.05, 0.01) == drift_noise(0.5, 0.01) < 5.0 * drift_noise(2e-3, 0.01)


def test_what_right_wheels_taught_is_kept_but_a_bias_may_have_drifted() -> None:
    c = derive(Parameters(), Robot())
    first, before = first_covariance(0.01, c), first_covariance(0.01, c)
    steady, drifting = (0.0, 0.0, 0.0), (0.0, np.radians(0.02), 0.0)
    assert np.array_equal(next_covariance(0.01, False, before, steady, c), first)
    before[GYRO_BIAS + 1, GYRO_BIAS + 1] = 1e-8  # the others are as unknown as ever
    following = next_covariance(0.01, True, before, steady, c)
    drifted = next_covariance(0.01, True, before, drifting, c)
    assert np.array_equal(following[:GYRO_BIAS, :GYRO_BIAS], first[:GYRO_BIAS, :GYRO_BIAS])
    kept = np.diag(following)[GYRO_BIAS:] / np.maximum(np.diag(first)[GYRO_BIAS:], 1e-12)
    assert kept[0] == kept[2] == 1.0
    assert 0.0 < kept[1] < 0.02
    assert np.array_equal(
        np.diag(drifted)[GYRO_BIAS:GYRO_GAIN], np.diag(first)[GYRO_BIAS:GYRO_GAIN]
    )
    assert np.all(kept[GYRO_GAIN - GYRO_BIAS :] < 0.2)


def test_repairs_of_a_beginning_are_a_turn_and_what_gravity_makes_of_it() -> None:
    """A tilt that is taken away for a second makes a velocity of g times it."""
    error, beginning = np.zeros(STATES), begin(0.01, 1e-3)
    error[ATTITUDE + 1], error[VELOCITY] = 0.02, 0.3
    beginning = with_repair(beginning, error, 0.0)
    for _ in range(round(1.0 / DT)):
        beginning = with_repair(carried(beginning, 0.0, DT), np.zeros(STATES), DT)
    assert beginning.turned == pytest.approx((0.0, 0.02))
    assert beginning.sped == pytest.approx((0.3 + 0.02 * STANDARD_GRAVITY, 0.0))
    assert beginning.variance == pytest.approx(0.011)
    assert not pulled_away(beginning)
    assert pulled_away(with_repair(beginning, 13.0 * error, DT))
    assert unrepaired(beginning).turned == unrepaired(beginning).sped == (0.0, 0.0)


@pytest.mark.parametrize(("axis", "unsure"), [(0, True), (1, True), (2, False)])
def test_a_quick_turn_leaves_the_vertical_unsure_by_the_gain_of_the_gyro(
    axis: int, unsure: bool
) -> None:
    """Half a turn in 0.5 s; rest ends it, and a turn about the vertical does not matter."""
    vertical = begin_vertical((0.0, 0.0, STANDARD_GRAVITY), (0.0, 0.0, 0.0), 0.0134)
    rate = [0.0, 0.0, 0.0]
    for k in range(100):
        rate[axis] = 2.0 * math.pi
        turn = 0.5 * rate[axis] * (k + 1) * DT
        parts = [0.0, 0.0, 0.0]
        parts[axis] = math.sin(turn)
        body = matrix_of((math.cos(turn), parts[0], parts[1], parts[2]))
        up = {"accel_x": body[6], "accel_y": body[7], "accel_z": body[8]}
        force = {name: STANDARD_GRAVITY * share for name, share in up.items()}
        spin = dict(zip(("gyro_x", "gyro_y", "gyro_z"), rate, strict=True))
        vertical = followed(
            vertical, body, (rate[0], rate[1], rate[2]), sample(**force, **spin), 0.0, 0.05
        )
    kept = MEMORY / 0.5 * (1.0 - math.exp(-0.5 / MEMORY))  # of a turn of that length
    deviation, expected = math.sqrt(variance_of(vertical)), GAIN_SHARE * 0.05 * math.pi * kept
    assert deviation == pytest.approx(expected if unsure else 0.005, rel=0.05)
    accel, still = (force["accel_x"], force["accel_y"], force["accel_z"]), (0.0, 0.0, 0.0)
    for _ in range(60):
        vertical = at_rest(vertical, body, accel, still, 1e-4, DT)
    assert math.sqrt(variance_of(vertical)) < 0.02


@pytest.mark.parametrize(("still", "proof"), [(True, False), (False, True)])
def test_a_body_that_lies_still_proves_no_wheels(still: bool, proof: bool) -> None:
    """What the squares remember of the motion before is no proof."""
    entry = filter_named("ins_odometer")
    geometry = entry.derive(entry.configure(), Robot()).geometry
    nav, moved = begin_navigation((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), (0.0, 1.0, 1.0)
    check = condemned(begin_check())._replace(known=1.0, waiting=0.0, slow=moved, fast=moved)
    for _ in range(40):
        reading = sample(wheel_count=2.0)
        now = read(nav, (0.0, 0.0, 0.0), reading, READ_ANEW)
        check = checked(check, reading, now, 1e-4, 0.0, geometry, still, False)
    assert (check.trust.proven > 0.1) is proof


@pytest.mark.parametrize("axis", [0, 1])
def test_the_vertical_learns_the_bias_of_the_gyro(axis: int) -> None:
    """The navigation turns by the bias, which the specific force does not follow."""
    bias = [0.0, 0.0, 0.0]
    bias[axis] = 0.02
    vertical = begin_vertical((0.0, 0.0, STANDARD_GRAVITY), (0.0, 0.0, 0.0), 0.01)
    turned = np.zeros(3)
    for _ in range(round(60.0 / DT)):
        turned += DT * np.array(bias)
        half = 0.5 * turned
        attitude = (math.cos(float(np.linalg.norm(half))), half[0], half[1], half[2])
        body = matrix_of(tuple(np.array(attitude) / np.linalg.norm(attitude)))  # type: ignore[arg-type]
        rate = (bias[0], bias[1], bias[2])
        reading = sample(gyro_x=bias[0], gyro_y=bias[1])
        vertical = followed(vertical, body, rate, reading, 0.0, 0.0)
    assert vertical.bias[axis] == pytest.approx(0.02, abs=0.002)


def drifted(bias: float, seconds: float, sway: float = 0.0) -> Vertical:
    """Return the vertical of a body that stands, or sways [m/s^2], with a gyro off by `bias`."""
    vertical = begin_vertical((0.0, 0.0, STANDARD_GRAVITY), (0.0, 0.0, 0.0), 0.0134)
    for k in range(round(seconds / DT)):
        turn = 0.5 * bias * (k + 1) * DT
        body = matrix_of((math.cos(turn), 0.0, math.sin(turn), 0.0))
        reading = sample(gyro_y=bias, accel_x=sway * math.sin(4.0 * k * DT))
        vertical = followed(vertical, body, (0.0, bias, 0.0), reading, 0.0, 0.0)
    return vertical


def test_a_mean_force_that_stays_aside_is_a_bias_of_the_gyro() -> None:
    assert leaning_variance(drifted(0.035, 8.0)) > math.radians(2.0) ** 2
    off = drifted(0.035, 16.0)
    missing = unknown_bias(off, LEVEL)
    assert missing[1] + off.bias[1] > 0.035
    assert missing[1] > 0.01 and missing[0] == 0.0
    learnt = drifted(0.035, 60.0)
    assert learnt.bias[1] == pytest.approx(0.035, abs=0.001)
    assert unknown_bias(learnt, LEVEL) == (0.0, 0.0, 0.0)
    sways = drifted(0.0, 20.0, sway=2.0)
    assert unknown_bias(sways, LEVEL) == (0.0, 0.0, 0.0)
    assert leaning_variance(sways) == 0.0


def test_a_force_that_goes_aside_at_once_is_an_acceleration() -> None:
    vertical = begin_vertical((0.0, 0.0, STANDARD_GRAVITY), (0.0, 0.0, 0.0), 0.0134)
    largest = 0.0
    for k in range(round(10.0 / DT)):
        reading = sample(accel_x=1.0 if 4.0 < k * DT < 7.0 else 0.0)
        vertical = followed(vertical, LEVEL, (0.0, 0.0, 0.0), reading, 0.0, 0.0)
        largest = max(largest, *map(abs, unknown_bias(vertical, LEVEL)))
        assert max(map(abs, vertical.crept)) <= CREEP * max(k * DT - 3.9, 0.1)
    assert largest < 0.006  # taken for a bias, a tenth of a radian would be 0.05 rad/s


@pytest.mark.parametrize(
    "up", [(0.0, 0.0, 1.0), (0.3, -0.4, 0.8), (1.0, 0.0, 0.0), (1e-4, 1e-4, -1.0), (0.0, 0.0, -1.0)]
)
def test_levelling_is_the_shortest_turn_to_the_vertical(up: Vector) -> None:
    vertical = begin_vertical((0.0, 0.0, STANDARD_GRAVITY), (0.0, 0.0, 0.0), 0.0134)
    turn = levelling(vertical._replace(up=unit(up)))
    assert rotated(matrix_of(turn), unit(up)) == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)
    assert turn[3] == 0.0


@pytest.mark.parametrize("changes", [0.1, 30.0])
def test_errors_of_the_accelerometer_fade_for_as_long_as_time_passes(changes: float) -> None:
    reading, fading = sample(), 0.0
    aiding = begin_aiding(reading)
    for _ in range(1000):
        aiding = watched(aiding, reading)
        fading += fading_time(aiding, changes, DT)
        if aiding.unchecked >= ROOM_PERIOD:
            aiding = aiding._replace(unchecked=0.0)  # as `aid` leaves it
    assert fading == pytest.approx(1000 * DT)


def test_the_vertical_takes_the_bias_that_right_wheels_have_shown() -> None:
    vertical = begin_vertical((0.0, 0.0, STANDARD_GRAVITY), (0.0, 0.0, 0.0), 0.0134)
    for _ in range(round(BIAS_AGREEMENT / DT)):
        vertical = agreed(vertical, (0.01, -0.08, 0.0), DT)
    assert vertical.bias == pytest.approx((0.0063, -0.0506, 0.0), abs=1e-3)


def test_a_steady_acceleration_is_no_rest() -> None:
    vertical = begin_vertical((0.0, 0.0, STANDARD_GRAVITY), (0.0, 0.0, 0.0), 0.0134)
    forward, sway = (2.0, 0.0, STANDARD_GRAVITY), 1e-3
    assert contradicts_rest(vertical, LEVEL, forward, sway, 0.5, 0.0)
    assert not contradicts_rest(vertical, LEVEL, forward, sway, 5.0, 0.0)
    assert not contradicts_rest(vertical, LEVEL, (0.2, 0.0, STANDARD_GRAVITY), sway, 0.5, 0.0)


def learnt(gain: float = 0.0, radius: float = 0.0) -> Navigation:
    """Return a navigation that has learnt a gain of the gyro and a wheel radius."""
    nav = begin_navigation((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    return nav._replace(gyro_gain=(0.0, gain, 0.0), wheel_radius=radius)


def test_errors_larger_than_a_calibration_leaves_are_strange() -> None:
    entry = filter_named("ins_odometer")
    c = entry.derive(entry.configure({"gyro_gain": 0.06, "wheel_radius": 0.01}), Robot())
    assert strangeness(learnt(gain=-0.06, radius=0.01), c) < 0.5
    assert strangeness(learnt(gain=-0.34), c) > 1.0
    assert strangeness(learnt(radius=0.07), c) > 1.0
    known = entry.derive(entry.configure({"gyro_gain": 0.0, "wheel_radius": 0.0}), Robot())
    assert strangeness(learnt(), known) == 0.0


def test_what_was_learnt_in_doubt_is_not_recalled() -> None:
    memory = begin_memory(learnt())
    for _ in range(2):
        memory = remembered(memory, learnt(gain=0.05), True, 4.0)
    memory = remembered(memory, learnt(gain=-0.3), False, 4.0)
    assert learnt_by(recalled(learnt(gain=-0.3), memory.older)) == learnt_by(learnt(gain=0.05))


def test_condemned_wheels_are_ignored_and_a_relapse_takes_longer_to_prove() -> None:
    check = condemned(begin_check())
    assert not believed(check)
    assert check.trust.ignored == 1.0
    believed_again = check.trust._replace(ignored=0.0, total=3.0, since=2.0)
    again = condemned(check._replace(trust=believed_again))
    assert again.trust.needed == RELAPSE_FACTOR * check.trust.needed
    assert condemned(again) == again


@pytest.mark.parametrize(
    ("factor", "right"), [(1.0, True), (-1.0, False), (2.0, False), (57.3, False)]
)
def test_wheels_that_are_wrong_from_the_start_are_condemned_by_their_first_move(
    factor: float, right: bool
) -> None:
    entry = filter_named("ins_odometer")
    geometry = entry.derive(entry.configure(), Robot()).geometry
    nav, check = begin_navigation((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), begin_check()
    turn = 2.0 * math.pi
    for k in range(round(2.0 / DT)):
        time = k * DT
        forward = 4.0 * math.sin(turn * time)
        travelled = 4.0 * (time - math.sin(turn * time) / turn) / turn
        reading = sample(
            accel_x=forward, wheel_angle=factor * travelled / geometry.wheel_radius, wheel_count=2.0
        )
        now = read(nav, (0.0, 0.0, 0.0), reading, READ_ANEW)
        check = first_checked(check, reading, now, LEVEL, 0.0, geometry, False, False)
        if passed_first(check):
            break
    assert passed_first(check)
    assert (check.trust.ignored == 0.0) is right


def test_right_wheels_are_not_condemned_in_a_spin_whose_first_vertical_is_wrong() -> None:
    entry = filter_named("ins_odometer")
    geometry = entry.derive(entry.configure(), Robot()).geometry
    nav, check = begin_navigation((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), begin_check()
    lean = np.array([[1.0, 0.0, 0.0], [0.0, math.cos(0.3), -math.sin(0.3)]])
    lean = np.vstack([lean, np.cross(*lean)])
    for k in range(round(2.0 / DT)):
        sine, cosine = math.sin(10.0 * k * DT), math.cos(10.0 * k * DT)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        leaning = tuple((lean @ turn).ravel().tolist())
        reading = sample(gyro_z=10.0, wheel_angle=0.01 * k * DT, wheel_count=2.0)
        now = read(nav, (0.0, 0.0, 10.0), reading, READ_ANEW)
        check = first_checked(check, reading, now, leaning, 0.0, geometry, False, False)
    assert check.trust.ignored == 0.0
