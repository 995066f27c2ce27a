"""The checks over the last seconds of a live stream."""

from __future__ import annotations

from struct import Struct
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..robot import Setup
from ..samples import Sample
from .finding import Finding

if TYPE_CHECKING:  # a node that filters starts without recordings
    from ..recording import FloatArray, Recording, StampArray, TiltTrack, WheelTrack

_FIELDS = len(Sample._fields)
_ROW = Struct(f"{_FIELDS}d")
_WHEELS = Sample._fields.index("wheel_angle")


class Latest(NamedTuple):
    """Copies of the last samples, and of the readings of the reference."""

    stamps: StampArray
    """Header stamps of the samples [ns], (n,)."""
    rows: FloatArray
    """The samples, (n, fields)."""
    reference_stamps: StampArray
    """Header stamps of the readings [ns], (m,)."""
    tilts: FloatArray
    """The readings [rad], (m,)."""

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.stamps[-1] - self.stamps[0]) * 1e-9

    def recording(self) -> Recording:
        """Return all as a recording."""
        from ..recording import ImuTrack, Recording

        imu = ImuTrack(self.stamps, self.rows[:, 1:4].copy(), self.rows[:, 4:7].copy())
        return Recording("live", imu, self._wheels(), self._tilt())

    def _wheels(self) -> WheelTrack | None:
        """Return the wheels where they were known."""
        from ..recording import WheelTrack

        known = self.rows[:, _WHEELS + 2] > 0.0
        if np.count_nonzero(known) < 2:
            return None
        mean, half = self.rows[known, _WHEELS], 0.5 * self.rows[known, _WHEELS + 1]
        single = self.rows[known, _WHEELS + 2].max() < 2.0
        angle = mean[:, None] if single else np.column_stack([mean - half, mean + half])
        return WheelTrack(self.stamps[known], angle)

    def _tilt(self) -> TiltTrack | None:
        from ..recording import TiltTrack

        if self.tilts.size < 3:
            return None
        stamps, first = np.unique(self.reference_stamps, return_index=True)
        return TiltTrack(stamps, self.tilts[first])


class RecentChecks:
    """Takes samples one by one; `findings` looks at the last of them.

    `add` writes into a ring of fixed size and allocates nothing; `findings` takes some 50 ms of
    a processor for 20 s of data, so call it every few seconds, not with each sample.
    """

    def __init__(self, setup: Setup, seconds: float = 20.0, fastest: float = 1000.0) -> None:
        """Make room.

        Args:
            setup: robot and calibration as configured.
            seconds: how far back the checks look [s].
            fastest: highest rate of samples that fits [Hz].
        """
        size = max(int(seconds * fastest), 2)
        self.setup = setup
        self._window = round(seconds * 1e9)
        self._rows = np.empty((size, _FIELDS))
        self._memory = self._rows.data.cast("B")
        """Memory of the rows: numpy takes three times as long to take a tuple."""
        self._stamps = np.empty(size, dtype=np.int64)
        self._reference_stamps = np.empty(size, dtype=np.int64)
        self._tilts = np.empty(size)
        self._count = self._references = 0
        self._latest = 0
        """Stamp of the last sample [ns]; kept beside the array, which is slower to look into."""

    def add(self, stamp: int, sample: Sample) -> None:
        """Take a sample.

        Args:
            stamp: its header stamp [ns].
            sample: IMU as the device reports it, with the wheels at that instant.
        """
        row = self._count % self._stamps.size
        if self._count and stamp <= self._latest:
            self.restart()
            row = 0
        self._stamps[row] = self._latest = stamp
        _ROW.pack_into(self._memory, row * _ROW.size, *sample)
        self._count += 1

    def add_reference(self, stamp: int, tilt: float) -> None:
        """Take a reading of the reference encoder [rad], stamped [ns]."""
        row = self._references % self._tilts.size
        self._reference_stamps[row], self._tilts[row] = stamp, tilt
        self._references += 1

    def restart(self) -> None:
        """Drop all samples, because time has jumped."""
        self._count = self._references = 0

    def findings(self) -> tuple[Finding, ...]:
        """Return what the last samples show; nothing before there are two."""
        from .check import check  # all checks; a node that filters starts without them

        recording = self.recording()
        return () if recording is None else check(recording, self.setup)

    def recording(self) -> Recording | None:
        """Return the last samples as a recording; None before there are two."""
        latest = self.latest()
        return None if latest is None else latest.recording()

    def latest(self) -> Latest | None:
        """Return the last samples; None before there are two."""
        stamps = _unrolled(self._stamps, self._count)
        first = np.searchsorted(stamps, self._latest - self._window)
        if stamps.size - first < 2:
            return None
        return Latest(
            stamps[first:],
            _unrolled(self._rows, self._count, int(first)),
            _unrolled(self._reference_stamps, self._references),
            _unrolled(self._tilts, self._references),
        )


def _unrolled(ring: NDArray[Any], count: int, first: int = 0) -> NDArray[Any]:
    """Return a copy of a ring into which `count` rows were written, without the `first` oldest."""
    size = ring.shape[0]
    begin, end = max(count - size, 0) + first, count
    if begin == end:
        return ring[:0].copy()
    begin, end = begin % size, (end - 1) % size + 1
    return ring[begin:end].copy() if begin < end else np.concatenate((ring[begin:], ring[:end]))
