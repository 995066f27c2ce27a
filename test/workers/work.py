"""Work for tests; it is imported by worker processes, too."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import Any

from twbr_estimation.workers import Channel


def squared(offset: int, unit: int, channel: Channel) -> int:
    """Return the square of a unit, and say so."""
    channel.send(f"at {unit}")
    return unit * unit + offset


def dies(folder: Path, unit: tuple[int, int], channel: Channel) -> int:
    """Return the number of a unit; its process dies so many times before."""
    number, deaths = unit
    die_at(folder / str(number), deaths)
    return number


def slow(folder: Path, unit: int, channel: Channel) -> int:
    """Return a unit after a moment in which one can be killed; leave a file with the process."""
    (folder / f"{unit}.{os.getpid()}").touch()
    while not (folder / "go").exists():
        time.sleep(0.02)
        channel.require_wanted()
    return unit


def refuses(shared: Any, unit: int, channel: Channel) -> int:
    """Raise for a unit."""
    raise ValueError(f"unit {unit}")


def die_at(mark: Path, deaths: int) -> None:
    """Kill this process where it was not done so many times before."""
    with mark.open("a") as file:
        file.write("x")
    if mark.stat().st_size <= deaths:
        os.kill(os.getpid(), signal.SIGKILL)
