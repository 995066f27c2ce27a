"""Time the compiled filters against the same loops in C, in one run, as ratios."""

from __future__ import annotations

import argparse
import ctypes
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from twbr_estimation.batch import CorrectedTrack
from twbr_estimation.batch.running import run_compiled
from twbr_estimation.filters import filter_named
from twbr_estimation.robot import Robot
from twbr_estimation.samples import CorrectedSample

SAMPLES = 2_000_000
PEERS = {
    "complementary": ("time_constant",),
    "alpha_beta_wb": ("alpha", "beta"),
    "kalman": ("q1", "q2", "r"),
}


def compile_peers(folder: str) -> ctypes.CDLL:
    """Compile kernels.c with the machine's gcc."""
    library = Path(folder) / "kernels.so"
    source = Path(__file__).with_name("kernels.c")
    flags = ["-O3", "-march=native", "-shared", "-fPIC"]
    subprocess.run(["gcc", *flags, "-o", str(library), str(source)], check=True)
    return ctypes.CDLL(str(library))


def corrected_noise() -> CorrectedTrack:
    """Return corrected samples of a noisy swing at 500 Hz."""
    random = np.random.default_rng(0)
    columns = random.normal(0.0, 0.1, (len(CorrectedSample._fields), SAMPLES))
    columns[0] = 0.002
    return CorrectedTrack(np.arange(SAMPLES, dtype=np.int64) * 2_000_000, columns)


def medians(
    ours: Callable[[], object], peer: Callable[[], object], rounds: int
) -> tuple[float, float]:
    """Return the median time of both [s], taken in turns."""
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(rounds):
        for run, kept in zip((ours, peer), times, strict=True):
            begin = time.perf_counter()
            run()
            kept.append(time.perf_counter() - begin)
    return float(np.median(times[0])), float(np.median(times[1]))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    if shutil.which("gcc") is None:
        print("filter kernels: no gcc here, so there is no peer to compare with")
        return 0
    track = corrected_noise()
    columns = [np.ascontiguousarray(track.field(name)) for name in ("dt", "angle", "gyro_y")]
    pointers = [column.ctypes.data_as(ctypes.c_void_p) for column in columns]
    print(f"filter kernels, {SAMPLES} samples, median of {rounds}: ns a sample, ratio to C")
    with tempfile.TemporaryDirectory() as folder:
        library = compile_peers(folder)
        for name, parameter_names in PEERS.items():
            entry = filter_named(name)
            chosen = entry.configure()
            values = np.array([getattr(chosen, each) for each in parameter_names])

            def ours(entry=entry, chosen=chosen) -> object:
                return run_compiled(entry, chosen, track, Robot(), None)

            def peer(name=name, values=values) -> object:
                out = np.zeros((4, SAMPLES))
                address = out.ctypes.data_as(ctypes.c_void_p)
                given = values.ctypes.data_as(ctypes.c_void_p)
                return getattr(library, name)(ctypes.c_size_t(SAMPLES), *pointers, given, address)

            ours()
            mine, theirs = medians(ours, peer, rounds)
            scale = 1e9 / SAMPLES
            print(
                f"  {name:15s} {mine * scale:6.2f}  C {theirs * scale:6.2f}"
                f"  ratio {mine / theirs:.2f}"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
