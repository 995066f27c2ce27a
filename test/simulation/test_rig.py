from __future__ import annotations

import numpy as np

from twbr_estimation.robot import Robot
from twbr_estimation.simulation.disturbances import disturb
from twbr_estimation.simulation.kernels import drive
from twbr_estimation.simulation.rig import (
    BALANCING,
    LYING,
    STOP_TILT,
    Inputs,
    RigState,
    loads,
    motion_of,
    next_voltage,
    step,
)
from twbr_estimation.simulation.rig_controller import balance_gains
from twbr_estimation.simulation.worlds import W2

PLANT = Robot().plant()
GAINS = balance_gains(PLANT, 0.005)
CALM = Inputs(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_single_steps_make_the_compiled_drive():
    noise = disturb(W2, 4000, 7)
    expected, _ = drive(noise, PLANT, GAINS, 0.005)
    state, voltage, pending = RigState(), 0.0, 0.0
    for i in range(1, 4000):
        now = Inputs(
            *(
                float(column[i - 1])
                for column in (
                    noise.push,
                    noise.slope,
                    noise.hit,
                    noise.target,
                    noise.target_speed,
                    noise.bump,
                    noise.slip,
                )
            )
        )
        if (i - 1) % 10 == 0:
            voltage = pending
            pending = next_voltage(state, now, pending, GAINS, PLANT.supply_voltage)
        acting = loads(state, now, PLANT)
        state = step(state, now, voltage, acting, PLANT)
        moved = motion_of(state, acting, voltage, tuple(noise.vibration[i]))
        np.testing.assert_allclose(moved, expected[i], rtol=1e-6, atol=1e-9)


def test_a_hard_push_ends_at_the_stop_and_upright_again():
    state, modes = RigState(), []
    for i in range(6000):
        pushed = CALM._replace(push=30.0 if i < 400 else 0.0)
        state = step(state, pushed, 0.0, loads(state, pushed, PLANT), PLANT)
        assert abs(state.plant.tilt) < STOP_TILT + 0.02
        modes.append(state.mode)
        if modes[-1] == BALANCING and LYING in modes:
            break
    assert state.falls == 1
    assert 0.25 <= 0.0005 * modes.count(LYING) < 0.26
    assert modes[-1] == BALANCING
    assert abs(state.plant.tilt) < 0.03


def test_an_obstacle_waits_until_the_robot_drives():
    hit = CALM._replace(hit=1.0)
    state = step(RigState(), hit, 0.0, loads(RigState(), hit, PLANT), PLANT)
    assert state.obstacle
    driving = state._replace(plant=state.plant._replace(velocity=0.8))
    after = step(driving, CALM, 0.0, loads(driving, CALM, PLANT), PLANT)
    assert not after.obstacle
    assert after.plant.velocity < 0.0 < after.plant.rate
