"""Every kind of stamp that can arrive has a defined outcome."""

from __future__ import annotations

import pytest

from twbr_estimation.streams.stamps import StampGuard, Verdict

MS = 1_000_000
START = 1_000_000_000_000
TAKE, SKIP, RESTART = Verdict.TAKE, Verdict.SKIP, Verdict.RESTART


@pytest.mark.parametrize(
    ("stamps", "verdicts", "counts"),
    [
        ((0, 2, 4), (TAKE, TAKE, TAKE), {}),
        ((0, -START // MS, 2), (TAKE, SKIP, TAKE), {"zero_stamp": 1}),
        ((0, 2, 2, 4), (TAKE, TAKE, SKIP, TAKE), {"repeated_stamp": 1}),
        ((0, 4, 2, 6), (TAKE, TAKE, SKIP, TAKE), {"late_stamp": 1}),
        ((0, 1000, 3000), (TAKE, TAKE, TAKE), {"gap": 1}),
        ((0, 5000, 2, 4), (TAKE, TAKE, RESTART, TAKE), {"gap": 1, "restart": 1}),
        # A clock set back by less than a second: the second sample in order shows it.
        ((800, 300, 302, 304), (TAKE, SKIP, RESTART, TAKE), {"late_stamp": 1, "restart": 1}),
        # Put right again: no time has passed in the step ahead.
        (
            (798, 800, 700, 702, 704, 804, 806),
            (TAKE, TAKE, SKIP, RESTART, TAKE, RESTART, TAKE),
            {"late_stamp": 1, "restart": 2},
        ),
        # A gap long after a step back, and one that is much shorter than it, are gaps.
        (
            (800, 700, 702, 740, 742, 90_000),
            (TAKE, SKIP, RESTART, TAKE, TAKE, TAKE),
            {"late_stamp": 1, "restart": 1, "gap": 1},
        ),
        # Two messages that changed places are no step back to be put right.
        (
            (800, 802, 797, 799, 803),
            (TAKE, TAKE, SKIP, RESTART, TAKE),
            {"late_stamp": 1, "restart": 1},
        ),
        # Two messages that were late one after the other, not a new order of time.
        ((8, 6, 4, 10), (TAKE, SKIP, SKIP, TAKE), {"late_stamp": 2}),
    ],
)
def test_outcome_of_stamps(
    stamps: tuple[int, ...], verdicts: tuple[Verdict, ...], counts: dict[str, int]
) -> None:
    guard = StampGuard()
    assert tuple(guard.check(START + stamp * MS) for stamp in stamps) == verdicts
    assert dict(guard.counts) == counts
