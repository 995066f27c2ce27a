"""The share of a recording's estimates that is valid, by the monitor of the live path."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..filters.base import Filter
from ..pipeline.validity import VALID_STDDEV, begin, certain, watch
from ..pipeline.watched_filter import SELF_JUDGED
from ..samples import RESTART_GAP, CorrectedSample, TiltEstimate
from .tracks import CorrectedTrack, EstimateTrack


def trusted_share(
    entry: Filter,
    corrected: CorrectedTrack,
    track: EstimateTrack,
    valid_stddev: float = VALID_STDDEV,
    usable: NDArray[np.bool_] | None = None,
) -> float:
    """Return the share of estimates that a live stream would call valid.

    Args:
        entry: the filter.
        corrected: n corrected samples.
        track: what the filter made of them.
        valid_stddev: deviation above which a tilt is not trusted [rad].
        usable: where nothing shows that the sensors contradict each other, (n,); by default all.

    Returns:
        From 0 to 1; nan without samples.
    """
    found = trusted(entry, corrected, track, valid_stddev)
    if usable is not None:
        found &= usable
    return float(np.mean(found)) if found.size else float("nan")


def trusted(
    entry: Filter,
    corrected: CorrectedTrack,
    track: EstimateTrack,
    valid_stddev: float = VALID_STDDEV,
) -> NDArray[np.bool_]:
    """Return which estimates a live stream would call valid, (n,).

    A recording's filter is not restarted, unlike a live one, so a filter that has diverged
    stays invalid until it converges again. Arguments as for `trusted_share`.
    """
    found, judge, valid = None, entry.name in SELF_JUDGED, []
    estimates = track.columns.T.tolist()
    for column, values in zip(corrected.columns.T.tolist(), estimates, strict=True):
        sample, estimate = CorrectedSample(*column), TiltEstimate(*values)
        if found is None or sample.dt > RESTART_GAP:
            found = begin(sample, estimate, found is not None, valid_stddev, judge)
        else:
            found = watch(found, sample, estimate, valid_stddev, judge)
        valid.append(found.judgement.trusted > 0.0 and certain(found))
    return np.array(valid, dtype=bool)
