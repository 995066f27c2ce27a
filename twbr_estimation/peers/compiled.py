"""Peers whose sample loop is compiled: VQF, and the network RIANN."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from ..recording import FloatArray
from .base import Inertial, Peer


def _vqf(samples: Inertial, time_constant: float) -> FloatArray:
    import vqf

    estimator = vqf.VQF(samples.period, tauAcc=time_constant)
    gyro, accel = (np.ascontiguousarray(each) for each in samples[:2])
    return np.asarray(estimator.updateBatch(gyro, accel)["quat6D"], dtype=np.float64)


def _riann(samples: Inertial) -> FloatArray:
    import riann

    network = riann.RIANN(str(Path(str(riann.__file__)).parent / "riann.onnx"))
    attitude = network.predict(samples.accel, samples.gyro, 1.0 / samples.period)
    return np.asarray(attitude, dtype=np.float64)


PEERS = (
    Peer("VQF 3 s", "vqf", partial(_vqf, time_constant=3.0)),
    Peer("VQF 6 s", "vqf", partial(_vqf, time_constant=6.0)),
    Peer("RIANN", "riann", _riann),
)
"""VQF (Laidig and Seel 2023) with its default time constant and a longer one, six axes; RIANN
(Weber 2021), as it was trained."""
