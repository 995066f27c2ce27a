"""How fast recordings are read: ours against rosbags' AnyReader with deserialisation.

A ten-minute recording at 500 Hz (300 000 messages each on imu/data_raw, joint_states and
reference/joint_states) is written as MCAP with zstd chunks and as sqlite3. Every reader
returns stamps, rates, accelerations, wheel angles and reference tilt as arrays. Peak memory
is that of a fresh process which does nothing but read.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader, StoragePlugin, Writer

from twbr_estimation.bags import read_recording, write_recording
from twbr_estimation.recording import ImuTrack, Recording, TiltTrack, WheelTrack

PERIOD_NS = 2_000_000
WANTED = ("/imu/data_raw", "/joint_states", "/reference/joint_states")
PEAK = """
import sys
from twbr_estimation.bags import read_recording
def peak():
    lines = open("/proc/self/status").read().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
before = peak()
read_recording(sys.argv[1])
print(before, peak())
"""


def make_recording(samples: int) -> Recording:
    """Return noise; constant values would compress and decompress too easily."""
    random = np.random.default_rng(1)
    stamps = 10**18 + PERIOD_NS * np.arange(samples)
    imu = ImuTrack(stamps, random.normal(size=(samples, 3)), random.normal(size=(samples, 3)))
    wheels = WheelTrack(stamps, np.cumsum(random.normal(size=(samples, 2)), axis=0))
    return Recording("bench", imu, wheels, TiltTrack(stamps, random.normal(size=samples)))


def copy_as_sqlite(source: Path, target: Path) -> None:
    """Write the messages of a recording into rosbag2's other storage."""
    with (
        Reader(source) as bag,
        Writer(target, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer,
    ):
        connections = {
            entry.id: writer.add_connection(
                entry.topic, entry.msgtype, msgdef=entry.msgdef.data, rihs01=entry.digest
            )
            for entry in bag.connections
        }
        for entry, stamp, raw in bag.messages():
            writer.write(connections[entry.id], stamp, raw)


def read_with_rosbags(path: Path) -> dict[str, np.ndarray]:
    """Return the same numbers as `read_recording`, message by message."""
    rows: dict[str, list[tuple[float, ...]]] = defaultdict(list)
    with AnyReader([path]) as reader:
        entries = [entry for entry in reader.connections if entry.topic in WANTED]
        for entry, _, raw in reader.messages(connections=entries):
            message = reader.deserialize(raw, entry.msgtype)
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            if entry.topic == WANTED[0]:
                rate, force = message.angular_velocity, message.linear_acceleration
                row = (stamp, rate.x, rate.y, rate.z, force.x, force.y, force.z)
            else:
                row = (stamp, *message.position)
            rows[entry.topic].append(row)
    return {topic: np.array(values) for topic, values in rows.items()}


def seconds(function, path: Path) -> float:
    start = time.perf_counter()
    function(path)
    return time.perf_counter() - start


def compare(kind: str, path: Path, required: float, repeats: int) -> None:
    ours = min(seconds(read_recording, path) for _ in range(repeats))
    theirs = seconds(read_with_rosbags, path)
    before, peak = measure_peak(path)
    print(
        f"{kind:8} ours {ours:6.2f} s   rosbags AnyReader {theirs:6.2f} s   "
        f"ratio {theirs / ours:5.1f} (required {required:g})   "
        f"peak memory {peak:.0f} MB (of which {before:.0f} MB imports)"
    )


def measure_peak(path: Path) -> tuple[float, float]:
    """Return the resident memory of a fresh process before and at its peak [MB].

    Linux only; `getrusage` would count the parent's memory too.
    """
    done = subprocess.run(
        [sys.executable, "-c", PEAK, str(path)], capture_output=True, text=True, check=True
    )
    before, peak = (float(number) / 1024.0 for number in done.stdout.split())
    return before, peak


def check_same(path: Path) -> None:
    """Stop where the two readers do not agree to the last bit."""
    ours, theirs = read_recording(path), read_with_rosbags(path)
    imu = theirs[WANTED[0]]
    assert ours.wheels is not None and ours.reference is not None
    np.testing.assert_array_equal(np.hstack([ours.imu.gyro, ours.imu.accel]), imu[:, 1:])
    np.testing.assert_array_equal(ours.wheels.angle, theirs[WANTED[1]][:, 1:])
    np.testing.assert_array_equal(ours.reference.tilt, theirs[WANTED[2]][:, 1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--repeats", type=int, default=3, help="runs of ours; the best counts")
    arguments = parser.parse_args()
    samples = round(arguments.minutes * 60e9 / PERIOD_NS)
    with tempfile.TemporaryDirectory() as folder:
        mcap, sqlite, short = (Path(folder, name) for name in ("mcap", "sqlite", "short"))
        write_recording(short, make_recording(5000))
        check_same(short)
        write_recording(mcap, make_recording(samples))
        copy_as_sqlite(mcap, sqlite)
        print(f"{samples} Imu messages, as many JointStates of the wheels and of the reference")
        compare("mcap", mcap, 10.0, arguments.repeats)
        compare("sqlite3", sqlite, 2.0, arguments.repeats)


if __name__ == "__main__":
    main()
