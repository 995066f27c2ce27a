"""The preset table2 against the tables as printed, and the eigenvalues that follow from it."""

from __future__ import annotations

import math
from importlib.resources import files
from typing import Any

import numpy as np
import pytest
import yaml

from twbr_estimation.filters import filter_named, filters

PERIODS_MS = (2, 5, 10, 20)
SQUARE_DEGREE = math.radians(1.0) ** 2

# Laddach 2022, Tables 1 and 2, columns 2, 5, 10, 20 ms.
LOW_PASS = {
    "rate_time_constant": (0.06874, 0.02392, 0.02557, 0.00774),
    "velocity_time_constant": (0.04607, 0.02031, 0.02045, -0.00065),
}
WOB = {
    "alpha": (0.00227, 0.00866, 0.00103, 0.00165),
    "beta": (1.58242, 1.12381, 1.67836, 1.84408),
}
WB = {"alpha": (0.00185, 0.00858, 0.00080, 0.00171), "beta": (-0.00018, -0.00007, 0.0, 0.0)}
FIRST_GAINS = {"first_tilt_gain": WB["alpha"], "first_bias_gain": WB["beta"]}
KALMAN = {"q1": (0.01076,) * 4, "q2": (0.0,) * 4, "r": (0.02792,) * 4, **FIRST_GAINS}
TABLE_2 = {
    "alpha_beta_wob": WOB,
    "alpha_beta_classic": WOB,
    "alpha_beta_wb": WB,
    "alpha_beta_theta_gamma": {
        "alpha": (0.00204, 0.00668, 0.00088, 0.00391),
        "beta": (-0.00001, -0.00005, 0.0, -0.00406),
        "theta": (1.07026, 1.05866, 1.05141, -0.04194),
        "gamma": (-0.00013, 0.00007, -0.00002, 1.87665),
    },
    "alpha_beta_theta_wa_a": {
        "alpha": (0.00169, 0.00850, 0.00080, 0.00165),
        "beta": (1.21567, 1.12964, 1.67821, 1.84410),
        "theta": (0.0, 0.0, 0.0, 0.0),
    },
    "alpha_beta_theta_wa_b": {
        "alpha": (0.00315, 0.00911, 0.00104, 0.00168),
        "beta": (0.28647, 0.32710, 0.69743, 1.01622),
        "theta": (0.00673, 0.01188, 0.06346, 0.17281),
    },
    "kalman": KALMAN,
    "kalman_printed": KALMAN,
    "kalman_tuned": {
        "q1": (0.00001, 0.00112, 0.0, 0.00001),
        "q2": (0.0,) * 4,
        "r": (2.30640, 17.16979, 2.25847, 2.92997),
        **FIRST_GAINS,
    },
    "complementary": {"time_constant": (1.06895, 0.60307, 9.74413, 12.40721)},
}
IN_SQUARE_DEGREES = ("q1", "q2", "r")

MODULI = {
    "alpha_beta_wob": (0.99773, 0.99134, 0.99897, 0.99835),
    "alpha_beta_wb": (0.99978, 0.99996, 1.0, 1.0),
    "alpha_beta_theta_gamma": (0.99973, 0.99945, 1.00002, 0.99834),
    "alpha_beta_theta_wa_a": (1.0, 1.0, 1.0, 1.0),
    "alpha_beta_theta_wa_b": (0.99685, 0.99089, 0.99896, 0.99832),
}
COMPLEMENTARY_POLES = (0.99813, 0.99178, 0.99897, 0.99839)

every_period = pytest.mark.parametrize("column", range(4), ids=[f"{ms}ms" for ms in PERIODS_MS])


def preset(column: int) -> dict[str, Any]:
    path = files("twbr_estimation") / "presets" / "table2" / f"{PERIODS_MS[column]}ms.yaml"
    parameters: dict[str, Any] = yaml.safe_load(path.read_text())["/**"]["ros__parameters"]
    return parameters


@every_period
def test_preset_has_the_printed_values(column: int) -> None:
    values = preset(column)
    assert set(values) & set(filters()) == set(TABLE_2)
    assert values["settings_dt"] == values["correction"]["dt"] == PERIODS_MS[column] / 1000
    for name, printed in (*TABLE_2.items(), ("correction", LOW_PASS)):
        for parameter, row in printed.items():
            unit = SQUARE_DEGREE if parameter in IN_SQUARE_DEGREES else 1.0
            assert values[name][parameter] == pytest.approx(row[column] * unit, rel=1e-6), name


@every_period
def test_preset_is_within_bounds_and_written_as_doubles(column: int) -> None:
    values = preset(column)
    for name in TABLE_2:
        filter_named(name).configure(values[name])
        assert all(type(value) is float for value in values[name].values()), name


@every_period
@pytest.mark.parametrize("name", MODULI)
def test_eigenvalue_of_largest_modulus(name: str, column: int) -> None:
    entry, values = filter_named(name), preset(column)
    parameters, dt = entry.configure(values[name]), values["settings_dt"]
    assert entry.matrices is not None
    modulus = np.abs(entry.matrices(parameters, dt).error_eigenvalues()).max()
    assert modulus == pytest.approx(MODULI[name][column], abs=5.1e-6)
    assert bool(entry.warnings(parameters, dt)) == (MODULI[name][column] >= 1.0)


@every_period
def test_complementary_forgets_at_the_printed_pole(column: int, still: Any) -> None:
    entry, values = filter_named("complementary"), preset(column)
    parameters = entry.configure(values["complementary"])
    sample = still(2, values["settings_dt"], 0.0)[1]
    after = entry.step(entry.state(1.0, 0.0), sample, parameters)
    assert after.tilt == pytest.approx(COMPLEMENTARY_POLES[column], abs=5.1e-6)
