"""Spectra and their overlap against signals whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from twbr_estimation.errors import RecordingError
from twbr_estimation.noise import angle_noise, spectrum, uniform_stretch
from twbr_estimation.noise.spectra import band_of

PERIOD = 0.002
TIMES = np.arange(50_000) * PERIOD
TILT = 10.0 * np.sin(2.0 * np.pi * 0.7 * TIMES) + 3.0 * np.sin(2.0 * np.pi * 1.3 * TIMES)
NOISE = np.random.default_rng(3).normal(0.0, 2.0, TIMES.size)


def test_the_area_under_a_spectrum_is_the_power() -> None:
    assert spectrum(TILT + 5.0, PERIOD).area() == pytest.approx(54.5, rel=0.05)
    assert spectrum(NOISE, PERIOD).area() == pytest.approx(4.0, rel=0.05)
    assert spectrum(NOISE, PERIOD).area(125.0) == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize("size", [300, 1999, 20_000])
def test_spectrum_and_coherence_are_those_of_scipy(size: int) -> None:
    """Whose import alone would take longer than all of a report's figures."""
    from scipy.signal import coherence, welch

    random = np.random.default_rng(1)
    tilt = 0.1 * random.normal(size=size).cumsum()
    error = 0.03 * tilt + random.normal(size=size)
    found = angle_noise(error, tilt, 0.002)
    segment = 2 * (found.spectrum.frequency.size - 1)
    options = {"nperseg": segment, "detrend": False}
    frequency, density = welch(error - error.mean(), fs=500.0, **options)
    np.testing.assert_allclose(found.spectrum.frequency, frequency)
    np.testing.assert_allclose(found.spectrum.density, density, rtol=1e-9)
    _, coherent = coherence(tilt - tilt.mean(), error - error.mean(), **options)
    chance = 1.0 / max(2, 2 * (size // segment) - 1)
    share = float(((coherent - chance) / (1.0 - chance) * density).sum() / density.sum())
    assert found.coherent_share == pytest.approx(max(0.0, share))


def test_the_motion_s_band_ends_above_its_fast_part() -> None:
    assert 0.7 < band_of(spectrum(TILT, PERIOD)) < 1.6


def test_what_follows_the_motion_is_separated_from_what_does_not() -> None:
    apart = angle_noise(NOISE, TILT, PERIOD)
    mixed = angle_noise(NOISE + 0.2 * TILT, TILT, PERIOD)
    assert apart.snr_db == pytest.approx(10.0 * np.log10(54.5 / 4.0), abs=0.3)
    assert apart.coherent_share == pytest.approx(0.0, abs=0.03)
    assert mixed.coherent_share == pytest.approx(2.18 / 6.18, abs=0.05)
    assert apart.in_band_deg2 is not None and mixed.in_band_deg2 is not None
    assert apart.in_band_deg2 < 0.1 < 2.0 < mixed.in_band_deg2


def test_a_reference_that_does_not_move_has_no_band() -> None:
    still = angle_noise(NOISE, np.full(TIMES.size, 1.0), PERIOD)
    assert (still.snr_db, still.in_band_deg2, still.coherent_share) == (None, None, None)
    assert still.area_deg2 == pytest.approx(4.0, rel=0.05)


def stamps(periods: np.ndarray) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(np.round(periods * 1e9).astype(np.int64))])


def test_the_longest_stretch_between_gaps_is_taken() -> None:
    periods = np.full(3000, 0.01)
    periods[[799, 1999]] = 0.4
    stretch = uniform_stretch(stamps(periods), "samples", 5.0)
    assert (stretch.first, stretch.last, stretch.left_out) == (800, 2000, 1801)
    assert stretch.period == pytest.approx(0.01)
    assert stretch.jitter == pytest.approx(0.0, abs=1e-12)


def test_jitter_is_measured() -> None:
    periods = np.random.default_rng(4).normal(0.01, 0.001, 2000)
    stretch = uniform_stretch(stamps(periods), "samples", 5.0)
    assert stretch.jitter == pytest.approx(0.001, rel=0.1)
    assert stretch.left_out == 0


def test_too_short_a_stretch_is_refused() -> None:
    with pytest.raises(RecordingError, match=r"samples: .* lasts 2 s; at least 5 s are needed"):
        uniform_stretch(stamps(np.full(199, 0.01)), "samples", 5.0)
    with pytest.raises(RecordingError, match="1 samples are too few"):
        uniform_stretch(stamps(np.zeros(0)), "samples", 5.0)
