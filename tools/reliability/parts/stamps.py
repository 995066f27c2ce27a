"""Stamps and clocks.

A robot swings by 20 deg while the stamps of its readings jump, repeat, come late or get lost. What
is said to be valid has to be right meanwhile, and all of it soon after.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from reliability.live_path import Arrival, judged
from reliability.motions import PERIOD, arrivals, setup_of, swing
from reliability.row import Effort, Row

FILTERS = ("ins_odometer", "complementary", "kalman_adaptive")
SECOND = 1_000_000_000
DURATION, FIRST, EVERY = 40.0, 8.0, 8.0
"""Of a recording, until its first fault, and between two [s]."""
SEEDS = 5
MOST_WRONG = 0.001
"""Share of the tilts that may be valid and wrong."""
RECOVERY = 3.0
"""Time after the last fault in which the tilt is right and valid again [s]."""
Fault = Callable[[list[Arrival], np.random.Generator], list[Arrival]]


def rows(effort: Effort) -> Iterator[Row]:
    """Run every fault on every filter and seed."""
    seeds = range(1000 * effort.seed, 1000 * effort.seed + effort.tries(SEEDS))
    for fault, spoil in faults().items():
        found = [_one(name, spoil, seed) for name in FILTERS for seed in seeds]
        wrong = max(each[0] for each in found)
        late = max(each[1] for each in found)
        raised = sum(each[2] for each in found)
        yield Row(
            f"{fault}; {', '.join(FILTERS)}",
            len(found),
            f"valid and wrong at most {MOST_WRONG:.1%}, right {RECOVERY:g} s after",
            f"valid and wrong at most {wrong:.3%}; right and valid {late:.2f} s after the last; "
            f"{raised} errors",
            wrong <= MOST_WRONG and late <= RECOVERY and raised == 0,
        )


def _one(name: str, spoil: Fault, seed: int) -> tuple[float, float, int]:
    random = np.random.default_rng([seed, 5])
    frequency, setup = float(random.uniform(0.3, 0.9)), setup_of()
    motion = swing(DURATION, 20.0, frequency)
    sound = list(arrivals(motion, setup, random))
    found = judged(name, spoil(sound, random), setup)
    last = instants()[-1] + 3.0
    return found.wrong_and_valid(), found.recovered(last), found.raised + found.not_finite


def instants() -> list[float]:
    """Return when the faults begin [s]."""
    return list(np.arange(FIRST, DURATION - EVERY + 1.0, EVERY))


def faults() -> dict[str, Fault]:
    """Return what is done to the stamps, by name."""
    found: dict[str, Fault] = {}
    for back in (0.1, 0.3, 0.5, 0.9):
        for lasts in (0.3, 1.0, 3.0):
            text = f"stamps {back:g} s back for {lasts:g} s, then right again"
            found[text] = partial(_shifted, by=-back, lasts=lasts)
    found["stamps 5 s back for 3 s"] = partial(_shifted, by=-5.0, lasts=3.0)
    found["stamps 5 s ahead for 3 s"] = partial(_shifted, by=5.0, lasts=3.0)
    found["stamps 0.5 s ahead for 1 s"] = partial(_shifted, by=0.5, lasts=1.0)
    found["stamps of zero for 1 s"] = _zeros
    found["every tenth reading one period late"] = _late
    found["every reading twice"] = _twice
    for lost in (0.1, 0.3, 0.6):
        found[f"{lost:g} s lost"] = partial(_lost, lasts=lost)
    return found


def _during(arrival: Arrival, lasts: float) -> bool:
    return any(begin <= arrival.time < begin + lasts for begin in instants())


def _shifted(
    sound: list[Arrival], random: np.random.Generator, by: float, lasts: float
) -> list[Arrival]:
    step = round(by * SECOND)
    return [
        each._replace(stamp=each.stamp + step) if _during(each, lasts) else each for each in sound
    ]


def _zeros(sound: list[Arrival], random: np.random.Generator) -> list[Arrival]:
    return [each._replace(stamp=0) if _during(each, 1.0) else each for each in sound]


def _late(sound: list[Arrival], random: np.random.Generator) -> list[Arrival]:
    late = 1.5 * PERIOD
    order = [(e.time + (late if random.random() < 0.1 else 0.0), i) for i, e in enumerate(sound)]
    return [sound[index] for _, index in sorted(order)]


def _twice(sound: list[Arrival], random: np.random.Generator) -> list[Arrival]:
    return [each for each in sound for _ in range(2)]


def _lost(sound: list[Arrival], random: np.random.Generator, lasts: float) -> list[Arrival]:
    return [each for each in sound if not _during(each, lasts)]
