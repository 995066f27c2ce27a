from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.drives import Drive
from twbr_estimation.errors import ConfigurationError, RecordingError
from twbr_estimation.robot import CorrectionSettings
from twbr_estimation.simulation import simulate
from twbr_estimation.tuning.filter import TuningTask
from twbr_estimation.tuning.objective import Objective, figure_of, prepare

TIME = np.arange(0.0, 10.0, 0.01)
TILT, SLOPE = 0.2 * np.sin(3.0 * TIME), 0.6 * np.cos(3.0 * TIME)


def test_mse_is_that_of_the_error_in_degrees() -> None:
    error = np.radians([1.0, -3.0])
    assert figure_of(Objective().terms(error, error, error, 0.01)) == pytest.approx(5.0)


def test_delay_is_priced_by_its_square() -> None:
    late = 0.2 * np.sin(3.0 * (TIME - 0.01))
    plain, priced = (
        figure_of(each.terms(late - TILT, late, SLOPE, 0.01))
        for each in (Objective(), Objective(0.02))
    )
    assert priced - plain == pytest.approx(0.02 * 10.0**2, rel=0.01)


def test_roughness_is_priced_by_the_slope_of_the_noise() -> None:
    noisy = TILT + 0.001 * (-1.0) ** np.arange(TILT.size)
    priced = Objective(roughness_weight=1e-3)
    steps = np.degrees(2 * 0.001 / 0.01) ** 2
    for tilt, expected in ((noisy, 1e-3 * steps), (TILT, 0.0)):
        rough, plain = (
            figure_of(each.terms(tilt - TILT, tilt, SLOPE, 0.01)) for each in (priced, Objective())
        )
        assert rough - plain == pytest.approx(expected, rel=0.01, abs=1e-4)


def test_a_hole_in_the_reference_is_no_roughness() -> None:
    made = simulate("ideal", 0.01, 8.0, 1)
    reference = made.recording.reference
    assert reference is not None
    kept = np.abs(1e-9 * (reference.stamps - reference.stamps[0]) - 4.0) > 1.0
    holed = replace(reference, stamps=reference.stamps[kept], tilt=reference.tilt[kept])
    rough = {}
    for name, each in (("whole", reference), ("holed", holed)):
        one = prepare(Drive(replace(made.recording, reference=each), made.setup))
        assert one.joined is not None
        assert np.count_nonzero(~one.joined) == (2 if name == "whole" else 5)
        tilt = one.reference
        nothing = np.zeros(tilt.size)
        priced = Objective(roughness_weight=1.0)
        rough[name] = figure_of(priced.terms(nothing, tilt, one.slope, one.dt, one.joined))
    assert rough["holed"] == pytest.approx(rough["whole"], rel=0.5)


def test_objectives_are_named() -> None:
    assert Objective.parsed("mse") == Objective()
    assert Objective.parsed("mse+roughness") == Objective(roughness_weight=1e-4)
    assert Objective.parsed("mse+delay=0.5+roughness=2") == Objective(0.5, 2.0)


@pytest.mark.parametrize(
    "text", ["", "mae", "mse+", "mse+delay=", "mse+delay=-1", "mse+delay=nan", "mse+delay+delay"]
)
def test_other_objectives_are_refused(text: str) -> None:
    with pytest.raises(ConfigurationError, match=r"expected mse.*delay=0\.01, roughness=0\.0001"):
        Objective.parsed(text)


def test_a_recording_without_reference_is_refused() -> None:
    made = simulate("ideal", 0.01, 1.0, 1)
    with pytest.raises(RecordingError, match="no reference to tune against"):
        prepare(Drive(replace(made.recording, reference=None), made.setup))


def test_the_slope_of_the_reference_is_the_true_rate_despite_its_counts(task: TuningTask) -> None:
    made = simulate("paper", 0.01, 20.0, 31)
    truth = made.recording.truth
    assert truth is not None and truth.rate is not None
    ready = task.training[0]
    difference = (ready.slope - truth.rate[ready.known])[1:-1]
    assert np.sqrt(np.mean(difference**2)) < 0.25 * np.sqrt(np.mean(truth.rate**2))


def test_other_settings_correct_again(task: TuningTask) -> None:
    ready = task.training[0]
    changed = ready.corrected_with(CorrectionSettings(euler=False))
    assert not np.array_equal(changed.corrected.field("angle"), ready.corrected.field("angle"))
    assert changed.setup.correction.euler is False
    back = changed.corrected_with(ready.setup.correction)
    assert np.array_equal(back.corrected.columns, ready.corrected.columns)
    assert ready.has_wheels


def test_a_reference_with_a_gap_is_compared_outside_of_it() -> None:
    recording = simulate("paper", 0.01, 20.0, 31).recording
    reference = recording.reference
    assert reference is not None
    whole = prepare(Drive(recording))
    assert isinstance(whole.known, slice)
    kept = (reference.stamps < reference.stamps[0] + 8e9) | (
        reference.stamps > reference.stamps[0] + 12e9
    )
    parts = replace(reference, stamps=reference.stamps[kept], tilt=reference.tilt[kept], rate=None)
    broken = prepare(Drive(replace(recording, reference=parts)))
    tilt = broken.corrected.field("angle")
    error = broken.errors(tilt[broken.known])
    assert 1500 < error.size < 1700
    assert set(error) <= set(whole.errors(tilt[whole.known]))


@pytest.mark.parametrize("hole", [(2e9, 4e9), (30e9, 30e9), (0.0, 15e9)])
def test_the_beginning_of_a_recording_is_judged_as_in_the_whole(hole: tuple[float, float]) -> None:
    recording = simulate("paper", 0.01, 20.0, 31).recording
    reference = recording.reference
    assert reference is not None
    time = reference.stamps - reference.stamps[0]
    kept = (time < hole[0]) | (time >= hole[1])
    parts = replace(reference, stamps=reference.stamps[kept], tilt=reference.tilt[kept], rate=None)
    whole = prepare(Drive(replace(recording, reference=parts)))
    part = whole.beginning
    if hole[0] == 0.0:  # no reference there
        assert part is whole
        return
    assert part.corrected.stamps.size == 500
    errors, first = (
        each.errors(each.corrected.field("angle")[each.known]) for each in (whole, part)
    )
    assert np.array_equal(first, errors[: first.size])
    assert np.array_equal(part.slope, whole.slope[: first.size])
    assert part.joined is None or part.joined.size == first.size - 1
