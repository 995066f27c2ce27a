"""A robot that is turned over: a batch has the tilt that a live filter has."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twbr_estimation.batch import CorrectedTrack, running
from twbr_estimation.batch.running import run_compiled
from twbr_estimation.filters import filter_named
from twbr_estimation.pipeline.watched_filter import WatchedFilter
from twbr_estimation.robot import Robot
from twbr_estimation.samples import STANDARD_GRAVITY, CorrectedSample

DT, TURN = 0.01, math.radians(200.0)


def track() -> CorrectedTrack:
    """Return samples of a robot that is turned over in 4 s, beyond half a turn, and back."""
    time, random = np.arange(0.0, 10.0, DT), np.random.default_rng(1)
    tilt = TURN * np.clip(np.minimum(time - 1.0, 9.0 - time) / 3.0, 0.0, 1.0)
    values = dict.fromkeys(CorrectedSample._fields, np.zeros(time.size))
    values["dt"] = np.where(time > 0.0, DT, 0.0)
    values["angle"] = np.angle(np.exp(1j * (tilt + 0.01 * random.standard_normal(time.size))))
    values["angle_variance"] = np.full(time.size, 1e-4)
    values["gyro_y"] = np.gradient(tilt, DT)
    values["accel_x"] = -STANDARD_GRAVITY * np.sin(values["angle"])
    values["accel_z"] = STANDARD_GRAVITY * np.cos(values["angle"])
    columns = np.array([values[field] for field in CorrectedSample._fields])
    return CorrectedTrack((1e9 * time).astype(np.int64), columns)


def live_tilt(name: str, samples: CorrectedTrack) -> list[float]:
    live = WatchedFilter(filter_named(name))
    found = [live.step(CorrectedSample(*each)).tilt for each in samples.columns.T.tolist()]
    assert live.restarts == 0
    return found


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("name", ["complementary", "kalman_adaptive", "alpha_beta_wb"])
def test_a_batch_follows_round_the_circle_as_a_live_filter_does(name: str, compiled: bool) -> None:
    entry, samples = filter_named(name), track()
    run = run_compiled if compiled else running._interpret
    found = run(entry, entry.configure(None), samples, Robot(), None).tilt
    assert found.tolist() == live_tilt(name, samples)
    off = np.angle(np.exp(1j * (found - samples.columns[1])))
    assert np.abs(off).max() < 0.2 and np.abs(found).max() <= math.pi
