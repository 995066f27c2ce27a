"""The share of a recording's estimates that deserves trust."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twbr_estimation.drives import Drive
from twbr_estimation.simulation import simulate


def test_bursts_of_lost_samples_lower_the_share_that_is_trusted() -> None:
    made = simulate("W2", 0.005, 12.0, 3)
    imu = made.recording.imu
    time = (imu.stamps - imu.stamps[0]) * 1e-9
    keep = (time < 2.0) | (time > 8.0) | (time % 1.6 > 0.5)
    bursts = replace(imu, stamps=imu.stamps[keep], gyro=imu.gyro[keep], accel=imu.accel[keep])
    whole = Drive(made.recording, made.setup).run("complementary", "kalman")
    holed = Drive(replace(made.recording, imu=bursts), made.setup).run("complementary", "kalman")
    for name in ("complementary", "kalman"):
        assert whole.trusted[name] > holed.trusted[name] + 0.1
    assert np.isfinite(list(holed.trusted.values())).all()
