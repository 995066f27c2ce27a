"""The default filter on a robot's hard days, as markdown: mean over seeds.

Mean square error [deg^2] of `ins_odometer` with and without its wheels and of `complementary`, the
largest error [deg], NEES, and the share of samples more than 5 deg wrong while the filter's own
variance lets the tilt count as valid, of `ins_odometer`.

    python bench/hard_days.py --first 4101 --seeds 2 --dt 0.005
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np

from twbr_estimation.batch import correct, run_filter
from twbr_estimation.filters import filter_named
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.simulation.hard_days import DAYS, Day
from twbr_estimation.streams.filter_configuration import FilterSettings

VALID = FilterSettings().valid_stddev ** 2
WRONG = 5.0
"""[deg]."""


def errors(name: str, made: Day, with_wheels: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return error [deg] and variance [rad^2] over time."""
    recording, truth = made.recording, made.recording.truth
    assert truth is not None
    track = correct(pair(recording.imu, recording.wheels if with_wheels else None), made.setup)
    entry = filter_named(name)
    found = run_filter(entry, entry.configure(), track, made.setup.robot)
    true = np.interp(track.stamps, truth.stamps, truth.tilt)
    wrong = np.angle(np.exp(1j * (found.tilt - true)))
    return np.degrees(wrong), found.tilt_variance


def figures(made: Day) -> Iterator[float]:
    """Yield the figures of one recording in the order of the table."""
    error, variance = errors("ins_odometer", made, True)
    yield float(np.mean(error**2))
    yield float(np.mean(errors("ins_odometer", made, False)[0] ** 2))
    yield float(np.mean(errors("complementary", made, True)[0] ** 2))
    yield float(np.abs(error).max())
    yield float(np.mean(np.radians(error) ** 2 / variance))
    yield 100.0 * float(np.mean((np.abs(error) > WRONG) & (variance <= VALID)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=4101, help="first seed; default: %(default)s")
    parser.add_argument("--seeds", type=int, default=2, help="default: %(default)s")
    parser.add_argument("--dt", type=float, default=0.005, help="[s]; default: %(default)s")
    chosen = parser.parse_args()
    print("| day | with wheels | without | complementary | largest error | NEES | wrong, valid |")
    print("|---|---|---|---|---|---|---|")
    for name, make in DAYS.items():
        seeds = range(chosen.first, chosen.first + chosen.seeds)
        rows = np.array([tuple(figures(make(seed, chosen.dt))) for seed in seeds])
        ours, blind, other, largest, nees, share = rows.mean(0)
        print(
            f"| {name} | {ours:.3f} | {blind:.3f} | {other:.3f} | {largest:.1f} | {nees:.2f} "
            f"| {share:.2f} % |",
            flush=True,
        )


if __name__ == "__main__":
    main()
