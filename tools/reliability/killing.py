"""Kill a command of `twbr` at random instants, again and again, and look at its files.

The command runs in a fork of this process, which has imported everything already: no instant is
wasted on the start.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from twbr_estimation.cli.main import main as twbr

Command = Callable[[Path], Sequence[str]]
"""Returns the command line for a folder to write into."""
Sound = Callable[[Path], bool]
"""Whether what is in the folder is whole, old or new."""


def in_a_fork(arguments: Sequence[str]) -> int:
    """Start `twbr` with these arguments in a fork, without output; return its process id."""
    child = os.fork()
    if child:
        return child
    status = 97
    try:
        silence = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silence, 1)
        os.dup2(silence, 2)
        sys.argv[:] = ["twbr", *arguments]
        status = twbr()
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(status)


def duration(arguments: Sequence[str]) -> float:
    """Run a command to its end; return how long it took [s].

    Raises:
        RuntimeError: it failed.
    """
    begin = time.monotonic()
    _, status = os.waitpid(in_a_fork(arguments), 0)
    if status != 0:
        raise RuntimeError(
            f"twbr {' '.join(arguments)}: status {os.waitstatus_to_exitcode(status)}"
        )
    return time.monotonic() - begin


def killed(command: Command, sound: Sound, folder: Path, tries: int, seed: int) -> Counter[str]:
    """Kill a command that rewrites its output at random instants.

    Args:
        command: Its arguments; it must write into the folder that it is given, and rewrite.
        sound: Looks at the folder after each kill.
        folder: An empty folder.
        tries: Number of kills.
        seed: Of the instants.

    Returns:
        How often the files were `whole` and `broken`, and how often it had `ended` before.
    """
    draw, counts = random.Random(seed), Counter[str]()
    lasts = max(duration(command(folder)), duration(command(folder)))
    for _ in range(tries):
        child = in_a_fork(command(folder))
        time.sleep(draw.uniform(0.0, lasts))
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        counts["ended"] += os.WIFEXITED(status)
        counts["whole" if sound(folder) else "broken"] += 1
    counts["left over"] = _left_over(command, folder)
    return counts


def _left_over(command: Command, folder: Path) -> int:
    """Return how many temporary files are there after the command has ended once more."""
    duration(command(folder))
    return sum(".partial" in path.name for path in folder.rglob("*"))


def emptied(folder: Path) -> Path:
    """Return the folder, new and empty."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder
