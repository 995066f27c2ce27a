"""Fewer points must draw the same line."""

from __future__ import annotations

import numpy as np

from twbr_estimation.report.decimation import peaks, thinned


def test_few_values_all_stay() -> None:
    assert peaks(np.arange(10.0), 20).tolist() == list(range(10))


def test_every_peak_stays() -> None:
    values = np.random.default_rng(1).normal(0.0, 0.1, 100_003)
    spikes = [5, 40_000, 40_001, 99_998]
    values[spikes] = [9.0, -8.0, 7.0, -9.0]
    kept = peaks(values, 2000)
    assert kept.size < 2200
    assert set(spikes) <= set(kept.tolist())
    assert kept[0] == 0 and kept[-1] == values.size - 1
    assert np.all(np.diff(kept) > 0)


def test_a_line_is_broken_at_its_gaps_and_nowhere_else() -> None:
    times = np.concatenate([np.arange(0.0, 50.0, 0.01), np.arange(60.0, 90.0, 0.01)])
    values = np.sin(times)
    fewer_times, fewer = thinned(times, values, 500)
    broken = np.flatnonzero(np.isnan(fewer))
    assert broken.size == 1
    assert fewer_times[broken[0] - 1] < 50.0 <= 60.0 <= fewer_times[broken[0] + 1]
    whole = thinned(times[:5000], values[:5000], 500)[1]
    assert not np.isnan(whole).any()
