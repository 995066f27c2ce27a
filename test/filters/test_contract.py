"""What every filter of the registry promises; a new file in `filters/` is tested as it is.

A filter that cannot keep a promise says so in its `limits`, by the clause's name, and the
test then checks that it really cannot.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twbr_estimation.batch import CorrectedTrack, EstimateTrack
from twbr_estimation.batch.running import run_compiled
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.filters import Filter, estimate_of, filters, listed_filters
from twbr_estimation.pipeline.tilt_filter import TiltFilter
from twbr_estimation.robot import Robot
from twbr_estimation.samples import RESTART_GAP, CorrectedSample, TiltEstimate

Motion = Callable[..., list[CorrectedSample]]
CLAUSES = {"convergence", "hand_over"}
"""Promises a filter may decline in its `limits`."""
SETTLING_TIME = 120.0
"""Within this a start that is 17 deg wrong is forgotten [s]; a bias takes longest."""

EQUIPMENT = ("imu", "one wheel", "two wheels", "motors", "saturation")
CASES = [
    (entry, equipment)
    for entry in filters().values()
    for equipment in (EQUIPMENT if entry.uses_wheels or entry.uses_motors else EQUIPMENT[:1])
]

WITH_MATRICES = [entry for entry in filters().values() if entry.matrices is not None]

every_filter = pytest.mark.parametrize("entry", filters().values(), ids=filters())
every_branch = pytest.mark.parametrize(
    ("entry", "equipment"), CASES, ids=[f"{entry.name}-{equipment}" for entry, equipment in CASES]
)
"""Every filter; those that read wheels or motors with all that their samples may hold."""


def start(entry: Filter, first: CorrectedSample, values: Any = None) -> tuple[Any, Any]:
    coefficients = entry.derive(entry.configure(values), Robot())
    return entry.reset(TiltEstimate(first.angle, first.gyro_y), first, coefficients), coefficients


def run(entry: Filter, state: Any, samples: Iterable[CorrectedSample], coefficients: Any) -> Any:
    states = []
    for sample in samples:
        state = entry.step(state, sample, coefficients)
        states.append(state)
    return states


def leaves(part: Any) -> Iterator[np.ndarray]:
    """Yield the arrays and numbers of a state, however they nest."""
    if isinstance(part, tuple):
        for inner in part:
            yield from leaves(inner)
    else:
        yield np.ravel(part)


def flat(states: Iterable[Any]) -> np.ndarray:
    """All numbers of all states, so that a hidden difference shows, too."""
    return np.array([np.concatenate([*leaves(state)]) for state in states])


def batch(entry: Filter, samples: list[CorrectedSample], state: Any = None) -> EstimateTrack:
    stamps = np.round(np.cumsum([sample.dt for sample in samples]) * 1e9).astype(np.int64)
    track = CorrectedTrack(stamps, np.ascontiguousarray(np.array(samples).T))
    return run_compiled(entry, entry.configure(), track, Robot(), state)


@every_branch
def test_same_samples_give_same_states(entry: Filter, swinging: Motion) -> None:
    samples = swinging(500)
    results = []
    for _ in range(2):
        state, coefficients = start(entry, samples[0])
        results.append(flat(run(entry, state, samples[1:], coefficients)))
    np.testing.assert_array_equal(*results)


@every_branch
def test_step_leaves_the_state_before_it_untouched(entry: Filter, swinging: Motion) -> None:
    samples = swinging(400)
    state, coefficients = start(entry, samples[0])
    middle = run(entry, state, samples[1:200], coefficients)[-1]
    first = flat(run(entry, middle, samples[200:], coefficients))
    again = flat(run(entry, middle, samples[200:], coefficients))
    np.testing.assert_array_equal(first, again)


@every_branch
def test_reset_forgets(entry: Filter, swinging: Motion) -> None:
    samples = swinging(400)
    fresh, coefficients = start(entry, samples[200])
    state, _ = start(entry, samples[0])
    run(entry, state, swinging(200, noise=10.0, seed=2)[1:], coefficients)
    used, _ = start(entry, samples[200])
    np.testing.assert_array_equal(
        flat(run(entry, used, samples[201:], coefficients)),
        flat(run(entry, fresh, samples[201:], coefficients)),
    )


@every_branch
def test_batch_equals_step_by_step(entry: Filter, swinging: Motion) -> None:
    samples = swinging(2000)
    state, coefficients = start(entry, samples[0])
    states = [state, *run(entry, state, samples[1:], coefficients)]
    compiled = batch(entry, samples)
    np.testing.assert_array_equal(compiled.columns.T, [estimate_of(state) for state in states])
    np.testing.assert_array_equal(flat([compiled.state]), flat(states[-1:]))


@every_branch
def test_batch_equals_the_live_stream_across_a_gap(entry: Filter, swinging: Motion) -> None:
    samples = swinging(600)
    samples[300] = samples[300]._replace(dt=RESTART_GAP + 0.5)
    live = TiltFilter(entry)
    np.testing.assert_array_equal(
        batch(entry, samples).columns.T, [live.step(sample) for sample in samples]
    )


@every_branch
def test_split_run_equals_the_whole(entry: Filter, swinging: Motion) -> None:
    samples = swinging(1000)
    whole = batch(entry, samples)
    first = batch(entry, samples[:321])
    second = batch(entry, samples[321:], first.state)
    joined = np.hstack([first.columns, second.columns])
    np.testing.assert_array_equal(joined, whole.columns)


@every_branch
def test_mirrored_motion_gives_mirrored_tilt(entry: Filter, swinging: Motion) -> None:
    samples = swinging(500)
    mirrored = [
        sample._replace(
            angle=-sample.angle,
            gyro_y=-sample.gyro_y,
            gyro_z=-sample.gyro_z,
            accel_x=-sample.accel_x,
            wheel_angle=-sample.wheel_angle,
            wheel_difference=-sample.wheel_difference,
            voltage=-sample.voltage,
            voltage_difference=-sample.voltage_difference,
        )
        for sample in samples
    ]
    there, back = batch(entry, samples), batch(entry, mirrored)
    np.testing.assert_allclose(back.tilt, -there.tilt, rtol=0, atol=1e-12)
    np.testing.assert_allclose(back.rate, -there.rate, rtol=0, atol=1e-12)
    np.testing.assert_allclose(back.gyro_bias, -there.gyro_bias, rtol=0, atol=1e-12)
    np.testing.assert_allclose(back.tilt_variance, there.tilt_variance, rtol=1e-9)


@every_branch
@pytest.mark.parametrize("dt", [1e-5, 0.002, 0.5])
def test_finite_input_gives_finite_output(entry: Filter, dt: float, swinging: Motion) -> None:
    random = np.random.default_rng(7)
    samples = []
    for sample in swinging(1000, dt=dt, jitter=0.9):
        shock = random.random() < 0.2
        samples.append(
            sample._replace(
                angle=float(random.uniform(-math.pi, math.pi)),
                gyro_y=float(random.choice([-1e4, 1e4])) if shock else sample.gyro_y,
                angle_variance=1e8 if shock else sample.angle_variance,
                gyro_variance_y=1e8 if shock else sample.gyro_variance_y,
                gyro_saturated_y=1.0 if shock else 0.0,
            )
        )
    assert np.isfinite(batch(entry, samples).columns).all()


@every_branch
@pytest.mark.parametrize("side", ["minimum", "maximum"])
def test_finite_at_the_bounds_of_each_parameter(entry: Filter, side: str, swinging: Motion) -> None:
    samples = swinging(200)
    for parameter in entry.declared():
        state, coefficients = start(
            entry, samples[0], {parameter.name: getattr(parameter.bounds, side)}
        )
        assert np.isfinite(flat(run(entry, state, samples[1:], coefficients))).all(), parameter


@every_filter
def test_still_robot_converges_to_its_angle(entry: Filter, still: Motion) -> None:
    dt = entry.tuned_dt or 0.005
    samples = still(round(SETTLING_TIME / dt), dt, 0.1)
    wrong = TiltEstimate(0.4, 0.0)
    state = entry.reset(wrong, samples[0], entry.derive(entry.configure(), Robot()))
    error = float(abs(batch(entry, samples[1:], state).tilt[-1] - 0.1))
    converged = error < math.radians(0.01)
    assert converged is ("convergence" not in entry.limits), f"{math.degrees(error)} deg left"


@every_filter
def test_takes_over_from_any_other_without_a_jump(entry: Filter, swinging: Motion) -> None:
    samples = swinging(400)
    smooth = True
    for other in filters().values():
        state, coefficients = start(other, samples[0])
        estimate = estimate_of(run(other, state, samples[1:300], coefficients)[-1])
        own = entry.derive(entry.configure(), Robot())
        state = entry.reset(estimate, samples[299], own)
        assert state.tilt == estimate.tilt
        assert state.rate == estimate.rate
        if entry.estimates_gyro_bias:
            assert state.gyro_bias == estimate.gyro_bias
        step = entry.step(state, samples[300], own).tilt - state.tilt
        residual = abs(samples[300].angle - state.tilt)
        expected = samples[300].gyro_y * samples[300].dt
        smooth = smooth and abs(step - expected) < math.radians(0.02) + 0.05 * residual
    assert smooth is ("hand_over" not in entry.limits)


@every_filter
def test_bounds_hold(entry: Filter) -> None:
    for parameter in entry.declared():
        bounds = parameter.bounds
        assert bounds.minimum <= parameter.default <= bounds.maximum
        for value in (bounds.minimum, bounds.maximum):
            assert getattr(entry.configure({parameter.name: value}), parameter.name) == value
        above = bounds.maximum + max(1e-6, 1e-6 * abs(bounds.maximum))
        below = bounds.minimum - max(1e-15, 1e-6 * abs(bounds.minimum))
        for value in (above, below, math.nan, math.inf, -math.inf, "fast"):
            with pytest.raises(ConfigurationError, match=rf"{entry.name}\.{parameter.name}"):
                entry.configure({parameter.name: value})  # type: ignore[dict-item]


@every_filter
def test_unknown_parameter_is_refused_with_the_known_ones(entry: Filter) -> None:
    with pytest.raises(ConfigurationError, match="no_such") as refusal:
        entry.configure({"no_such": 1.0})
    assert all(parameter.name in str(refusal.value) for parameter in entry.declared())


@every_filter
def test_describes_itself(entry: Filter) -> None:
    assert entry.title.endswith(".") and entry.source
    assert {"tilt", "rate"} <= set(entry.state._fields)
    assert set(entry.limits) <= CLAUSES and all(entry.limits.values())
    for parameter in entry.declared():
        assert parameter.bounds.unit and parameter.bounds.description.endswith(".")


@pytest.mark.parametrize("entry", WITH_MATRICES, ids=lambda entry: entry.name)
def test_warns_exactly_where_an_eigenvalue_reaches_one(entry: Filter) -> None:
    assert entry.matrices is not None
    for values in ({}, {entry.declared()[0].name: entry.declared()[0].bounds.minimum}):
        parameters = entry.configure(values)
        modulus = np.abs(entry.matrices(parameters, 0.002).error_eigenvalues()).max()
        warned = any("eigenvalue" in line for line in entry.warnings(parameters, 0.002))
        assert warned == (modulus >= 1.0)


def test_registry_finds_every_filter_file() -> None:
    folder = Path(str(import_module("twbr_estimation.filters").__file__)).parent
    files = {path.stem for path in folder.glob("*.py") if "\nFILTER = " in path.read_text()}
    assert files == set(filters())


def test_historical_filters_are_there_by_name_only() -> None:
    historical = {"alpha_beta_classic", "kalman_printed", "kalman_simplified"}
    assert set(filters()) - set(listed_filters()) == historical | {"complementary_lagged"}
