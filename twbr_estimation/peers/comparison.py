"""Peers and filters of the package on one recording: same samples, same scoring, same clock."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..batch import CorrectedTrack
from ..batch.running import run_compiled
from ..drives import Drive
from ..errors import ConfigurationError
from ..filters import filter_named
from ..recording import FloatArray, TiltTrack
from ..ros_messages import tilt_of_quaternion
from ..scoring.score import RecordingScore, score_recording
from .base import Inertial, Peer
from .compiled import PEERS as COMPILED
from .stepped import PEERS as STEPPED

PEERS: tuple[Peer, ...] = (*COMPILED, *STEPPED)
OURS = ("ins_odometer", "complementary")
"""Filters of the package that are compared by default."""
BLIND = ", no wheels"
"""Added to the name of a filter that does not get the wheels."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """All estimators on one recording."""

    score: RecordingScore
    microseconds: Mapping[str, float]
    """CPU time for one sample, by estimator."""
    missing: tuple[str, ...]
    """Peers left out, each with what to install."""


def chosen(names: Sequence[str]) -> tuple[Peer, ...]:
    """Return the peers of those names or packages; all where there are none.

    Raises:
        ConfigurationError: an unknown name; the message lists those there are.
    """
    for name in names:
        if not any(name in (peer.name, peer.package) for peer in PEERS):
            known = ", ".join(dict.fromkeys(each for p in PEERS for each in (p.package, p.name)))
            raise ConfigurationError(f"there is no peer {name!r}; there are: {known}")
    return tuple(p for p in PEERS if not names or p.name in names or p.package in names)


def compare(drive: Drive, peers: Iterable[Peer] = PEERS, ours: Sequence[str] = OURS) -> Comparison:
    """Run everything on one recording.

    Args:
        drive: the recording, with a reference; its wheels are for filters of the package.
        peers: what to run; one whose package is missing is left out.
        ours: filters of the package; on a recording with wheels each runs without them, too.

    Raises:
        TwbrError: no reference, or an unknown filter.
    """
    recording = drive.recording
    blind = replace(drive, recording=replace(recording, wheels=None))
    fed = {"": blind} if recording.wheels is None else {"": drive, BLIND: blind}
    runs: dict[str, Callable[[], FloatArray]] = {
        name + suffix: partial(own_tilt, name, each)
        for name in ours
        for suffix, each in fed.items()
    }
    for run in runs.values():
        run()  # compiles
    samples = inertial(blind.corrected)
    missing = []
    for peer in peers:
        try:
            peer.run(Inertial(samples.gyro[:2], samples.accel[:2], samples.period))  # imports
            runs[peer.name] = partial(peer_tilt, peer, samples)
        except ImportError:
            missing.append(f"{peer.name}: pip install {peer.package}")
    tracks, microseconds = {}, {}
    for name, run in runs.items():
        start = time.process_time()
        tilt = run()
        microseconds[name] = 1e6 * (time.process_time() - start) / tilt.size
        tracks[name] = TiltTrack(blind.corrected.stamps, tilt)
    tracks.update(recording.estimators)
    score = score_recording(recording, tracks, drive.options)
    return Comparison(score, microseconds, tuple(missing))


def inertial(corrected: CorrectedTrack) -> Inertial:
    """Return corrected samples as the input of peers."""
    gyro, accel = (
        np.column_stack([corrected.field(f"{kind}_{axis}") for axis in "xyz"])
        for kind in ("gyro", "accel")
    )
    return Inertial(gyro, accel, float(np.mean(np.diff(corrected.stamps))) * 1e-9)


def peer_tilt(peer: Peer, samples: Inertial) -> FloatArray:
    """Return the tilt by a peer [rad], (n,)."""
    w, x, y, z = peer.run(samples).T
    return np.asarray(tilt_of_quaternion(x, y, z, w), dtype=np.float64)


def own_tilt(name: str, drive: Drive) -> FloatArray:
    """Return the tilt by a filter of the package with the drive's settings [rad], (n,)."""
    entry = filter_named(name)
    parameters = entry.configure(drive.settings.values.get(name, {}))
    return run_compiled(entry, parameters, drive.corrected, drive.setup.robot, None).tilt
