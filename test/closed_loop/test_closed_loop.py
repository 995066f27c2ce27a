"""Estimators in the loop: what they keep upright, what a switch does, what a run depends on."""

from __future__ import annotations

import math
from copy import deepcopy
from dataclasses import replace

import pytest

from twbr_estimation.closed_loop.trial import TRUTH, Loop, Trial, run
from twbr_estimation.closed_loop.trials import run_all, standings
from twbr_estimation.configuration.presets import preset
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.filters import filters, listed_filters
from twbr_estimation.streams.filter_configuration import FilterConfiguration, FilterSettings
from twbr_estimation.streams.filtering import FilterStream

CORRECTION, TABLE2 = preset("table2", 0.005)
# The classic form is no filter of the table: with the values of its row it diverges.
FILTERS_OF_TABLE_2 = tuple(name for name in TABLE2.values if name != "alpha_beta_classic")
SEED = 5001
"""Never tuned on; the whole table is in docs/balancing.md."""


def trial(estimator: str, controller: str = "pid", **changes) -> Trial:
    values = {estimator: TABLE2.values.get(estimator, {})}
    made = Trial("paper", estimator, controller, SEED, 10.0, 0.005, 0.5, values, CORRECTION)
    return replace(made, **changes)


@pytest.mark.parametrize("name", [TRUTH, "ins_odometer", *FILTERS_OF_TABLE_2])
def test_it_keeps_the_papers_robot_upright(name):
    outcome, start = run(trial(name)), run(trial(name, duration=1.0))
    assert outcome.falls == 0
    assert outcome.upright == 1.0
    assert start.cut < 0.25  # s, of one: a filter may need a moment to trust itself
    assert 10.0 * outcome.cut == pytest.approx(start.cut)  # and none later
    assert outcome.rms_tilt < math.radians(10.0)
    assert 0.5 < outcome.effort < 6.0


def test_the_truth_has_no_error_and_others_have():
    assert run(trial(TRUTH, duration=3.0)).rms_error == 0.0
    assert run(trial("complementary")).rms_error > math.radians(0.1)


def test_a_tilt_that_is_far_off_falls():
    outcome = run(trial("alpha_beta_classic", values={}))
    assert outcome.falls > 0
    assert outcome.first_fall < 10.0
    assert outcome.upright < 1.0


def test_the_number_of_processes_changes_nothing():
    trials = [trial("complementary", seed=seed, duration=2.0) for seed in (1, 2, 3)]
    seen: list[int] = []
    alone = run_all(trials, seen.append, jobs=1)
    assert seen == [1, 2, 3]
    assert run_all(trials, lambda done: None, jobs=2) == alone
    (entry,) = standings(trials, alone)
    assert entry.seeds == 3
    assert entry.mean["rms_tilt"] == pytest.approx(sum(each.rms_tilt for each in alone) / 3)


def test_periods_that_do_not_fit_are_refused():
    with pytest.raises(ConfigurationError, match="multiple"):
        Loop(trial(TRUTH, dt=0.002))


NOT_BY_ITSELF = {
    "dynamic_calibrating": "its model of the robot has no pushes: one makes an error of 17 deg",
    "dynamic_planar": "the same: it falls",
    "dynamic_yaw": "the same: it falls",
    "accelerometer": "vibration and the robot's own motion: it falls within seconds",
    "alpha_beta_classic": "kept as printed, for a sensor of position alone: it falls at once",
}
"""Filters that cannot balance the robot, whichever was active before."""


def test_switching_every_second_under_pushes_neither_falls_nor_jumps():
    """A switch may step by what the two filters differ, and by no more than 0.1 deg beyond."""
    names = [name for name in listed_filters() if name not in NOT_BY_ITSELF]
    loop = Loop(trial(names[0], pushes=0.0))
    values = {name: TABLE2.values.get(name, {}) for name in filters()}
    robot = loop.robot.setup.robot
    speaking = FilterConfiguration(FilterSettings(names[0], compare=("all",)), values, robot)
    loop.filters = FilterStream(speaking)
    steps = {}
    for number, name in enumerate([*names[1:], *names]):
        for k in range(200):
            if k == 100:
                loop.robot.push(2.5 * (-1.0) ** number, 0.15)
            loop.step()
            loop.filters.compare(loop.corrected)
        assert loop.robot.falls == 0, name
        before = deepcopy(loop.filters)
        speaking = replace(speaking, settings=replace(speaking.settings, filter=name))
        loop.filters.configure(speaking)
        loop.step()
        beside = loop.filters.compare(loop.corrected)[name].tilt
        unswitched = before.step(loop.corrected).tilt
        steps[name] = abs(loop.estimate - unswitched) - abs(beside - unswitched)
    assert max(steps.values()) < math.radians(0.1), steps
