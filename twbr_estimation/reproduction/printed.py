"""The figures that the papers print; Laddach 2022's parameters are the preset `table2`."""

from __future__ import annotations

from collections.abc import Mapping

PERIODS = (0.002, 0.005, 0.01, 0.02)
"""Sampling periods of Tables 1 and 2 [s]."""

RAW_MSE = (150.56951, 515.27065, 377.39749, 280.23692)
"""Table 1: MSE of the arctangent of the readings by period [deg^2]."""
CORRECTED_MSE = (72.52314, 222.05807, 174.45667, 110.55792)
"""Table 1: MSE of the corrected angle by period [deg^2]."""

ROWS: Mapping[str, tuple[tuple[float, float], ...]] = {
    "alpha_beta_wob": (
        (1.98686, 0.82071),
        (6.18150, 3.07579),
        (1.60046, 11.94604),
        (2.32469, 3.34761),
    ),
    "alpha_beta_wb": (
        (1.93816, 0.78603),
        (6.16623, 3.05931),
        (1.73683, 14.17050),
        (3.07329, 4.05407),
    ),
    "alpha_beta_theta_gamma": (
        (0.74852, 1.33160),
        (3.91003, 2.12875),
        (0.61819, 12.05841),
        (2.32142, 3.34578),
    ),
    "alpha_beta_theta_wa_a": (
        (1.94261, 0.86258),
        (6.16275, 3.07526),
        (1.58494, 13.92453),
        (2.32469, 3.34753),
    ),
    "alpha_beta_theta_wa_b": (
        (1.87487, 1.12021),
        (5.43600, 2.81706),
        (1.33276, 11.34403),
        (2.06774, 3.07125),
    ),
    "kalman_printed": (
        (6.88674, 11.08092),
        (9.45858, 6.80941),
        (9.41660, 6.79686),
        (7.98366, 12.38334),
    ),
    "kalman_tuned": (
        (1.94297, 0.79206),
        (6.17602, 3.03979),
        (1.73928, 13.73496),
        (3.07025, 4.10513),
    ),
    "complementary": (
        (2.01177, 0.82619),
        (6.39301, 3.38819),
        (1.92216, 12.33891),
        (3.31344, 4.30363),
    ),
}
"""Table 2: training and verification MSE [deg^2] by filter and period.

`kalman_printed` is the row "Kalman", `kalman_tuned` the row "Kalman*".
"""
UNPRINTED = ("kalman",)
"""Filters that stand beside the rows: `kalman` has the row "Kalman" with q1 dt^2."""

SCALE_MSE: Mapping[str, tuple[float, float]] = {"x": (0.04817, 0.02720), "z": (0.03465, 0.02898)}
"""Figs 9 (x') and 10 (y', our z): MSE before and after the polynomial [(m/s^2)^2]."""

ANGLE_SNR_DB = 6.3
"""Text on Fig. 11: motion over noise of the corrected angle."""
FIGURE_12 = ("alpha_beta_wb", 0.01)
"""Filter and period of Fig. 12."""

STAND_ACCELEROMETER_DEG = 1.25
"""Chudzik 2021, text on Fig. 7: standard deviation of the accelerometer's angle [deg]."""
STAND_UNCERTAINTY_DEG = 1.0
"""Chudzik 2021, section II: the uncertainty that a stable vehicle needs [deg]."""

TABLE_3: Mapping[str, tuple[float, float, float]] = {
    "DMP": (0.0148, 0.0115, 0.0129),
    "planar": (0.0133, 0.0256, 0.1028),
    "yaw": (0.0133, 0.0107, 0.0249),
    "CF": (0.0228, 0.0424, 0.1605),
    "CKF": (0.0199, 0.0432, 0.1636),
}
"""Sihite 2018, Table III: rms error [rad] at 0, 5 and 10 rad/s."""
