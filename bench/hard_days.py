"""The default filter on a robot's hard days, as markdown: mean over seeds.

Mean square error [deg^2] of `ins_odometer` with and without its wheels and of `complementary`, the
largest error [deg], NEES, the share of samples more than 5 deg wrong that a live stream calls
valid, and the largest error from 0.5 s after the body has come to rest on [deg], of `ins_odometer`.

    python bench/hard_days.py --first 4101 --seeds 2 --dt 0.005
"""

from __future__ import annotations

import argparse

import numpy as np

from twbr_estimation.batch import CorrectedTrack, EstimateTrack, correct, run_filter
from twbr_estimation.batch.judging import trusted
from twbr_estimation.filters import filter_named
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.recording import FloatArray
from twbr_estimation.simulation.hard_days import DAYS, Day

WRONG = 5.0
"""[deg]."""
RECOVERED = 0.5
"""[s]."""
INS = filter_named("ins_odometer")


def run(
    name: str, made: Day, with_wheels: bool
) -> tuple[CorrectedTrack, EstimateTrack, FloatArray]:
    """Return the samples, the estimates and their errors [deg]."""
    recording, truth = made.recording, made.recording.truth
    assert truth is not None
    track = correct(pair(recording.imu, recording.wheels if with_wheels else None), made.setup)
    entry = filter_named(name)
    found = run_filter(entry, entry.configure(), track, made.setup.robot)
    true = np.interp(track.stamps, truth.stamps, truth.tilt)
    return track, found, np.degrees(np.angle(np.exp(1j * (found.tilt - true))))


def at_rest(made: Day, track: CorrectedTrack, error: FloatArray) -> float:
    """Return the largest error while the body lies still, but for the time to recover [deg]."""
    time = (track.stamps - track.stamps[0]) * 1e-9
    chosen = np.zeros(time.size, dtype=bool)
    for begin, end in made.rests:
        chosen |= (time > begin + RECOVERED) & (time < end)
    return float(np.abs(error[chosen]).max()) if chosen.any() else float("nan")


def figures(made: Day) -> tuple[float, ...]:
    """Return the figures of one recording in the order of the table."""
    track, found, error = run(INS.name, made, True)
    return (
        float(np.mean(error**2)),
        float(np.mean(run(INS.name, made, False)[2] ** 2)),
        float(np.mean(run("complementary", made, True)[2] ** 2)),
        float(np.abs(error).max()),
        float(np.mean(np.radians(error) ** 2 / found.tilt_variance)),
        100.0 * float(np.mean((np.abs(error) > WRONG) & trusted(INS, track, found))),
        at_rest(made, track, error),
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=4101, help="first seed; default: %(default)s")
    parser.add_argument("--seeds", type=int, default=2, help="default: %(default)s")
    parser.add_argument("--dt", type=float, default=0.005, help="[s]; default: %(default)s")
    chosen = parser.parse_args()
    columns = "with wheels | without | complementary | largest | NEES | wrong, valid | at rest"
    print(f"| day | {columns} |")
    print("|---|---|---|---|---|---|---|---|")
    for name, make in DAYS.items():
        seeds = range(chosen.first, chosen.first + chosen.seeds)
        rows = np.array([figures(make(seed, chosen.dt)) for seed in seeds])
        ours, blind, other, _, nees, share, _ = rows.mean(0)
        _, _, _, largest, _, _, rest = rows.max(0)
        lies = "" if np.isnan(rest) else f"{rest:.1f}"
        print(
            f"| {name} | {ours:.3f} | {blind:.3f} | {other:.3f} | {largest:.1f} | {nees:.2f} "
            f"| {share:.2f} % | {lies} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
