"""Table 2's printed gains on the simulated rig of the paper, mean over several seeds."""

from __future__ import annotations

from dataclasses import replace

import pytest

from twbr_estimation.configuration.presets import preset
from twbr_estimation.drives import Drive
from twbr_estimation.scoring.score import mean_over
from twbr_estimation.simulation.simulate import simulate

SEEDS = range(1, 9)
ON_A_PAR = (
    "alpha_beta_wob",
    "alpha_beta_wb",
    "alpha_beta_theta_gamma",
    "alpha_beta_theta_wa_a",
    "alpha_beta_theta_wa_b",
    "kalman",
    "kalman_tuned",
    "complementary",
)
"""One row of Table 2 each, but that `kalman` stands for the printed one."""


@pytest.mark.parametrize("dt", [0.002, 0.005])
def test_printed_gains_give_errors_like_the_printed_ones(dt: float) -> None:
    correction, settings = preset("table2", dt)
    assert correction is not None
    scores = []
    for seed in SEEDS:
        simulated = simulate("paper", dt, 60.0, seed)
        setup = replace(simulated.setup, correction=correction)
        drive = Drive(simulated.recording, setup, settings)
        scores.append(drive.run(*settings.values).scores())
    mse = {name: figures["mse_deg2"] for name, figures in mean_over(scores).items()}
    for name in ON_A_PAR:
        assert 0.7 < mse[name] < 3.0, f"{name}: {mse[name]} deg^2; Table 2 prints 0.7 to 6.2"
    # It follows the corrected angle, whose error on the rig is Table 1's at 2 ms and a quarter
    # of it at 5 ms, where the paper used another recording.
    assert (4.0 if dt == 0.002 else 2.5) < mse["kalman_printed"] < 16.0
    assert mse["kalman_printed"] > 2.0 * mse["kalman"]
    assert mse["alpha_beta_classic"] > 1000.0
