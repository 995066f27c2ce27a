"""Kill a writer at random instants and at each step, and fill its disk at every stage.

`tried` starts this file with the library of `file_faults.py`. The writer runs once up to its first
step of writing; from there it is continued in one fork after another, each with another end: no
time is spent on what it computes before.
"""

from __future__ import annotations

import errno
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NoReturn

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from reliability.file_faults import FAILING, Stage, arm, counted
from reliability.writers import Writer, writers

FAULTS_A_STAGE = 6
"""Calls of a stage that fail, one in each try, spread over all of them."""
PATIENCE = 60.0
"""Time after which a process counts as hung [s]."""
FIRST_PATIENCE = 600.0
"""The same for a first run, which may have to compile [s]."""
FAILED = 97
SPACE = "no space left on device"


def tried(name: str, folder: Path, library: Path, kills: int, seed: int) -> Counter[str]:
    """Try a writer in a process of its own.

    Args:
        name: One of `writers`.
        folder: Empty; all it writes is in there.
        library: Of `file_faults`.
        kills: How often it is killed.
        seed: Of the instants.

    Returns:
        What was seen; an example of what is wrong is printed.

    Raises:
        subprocess.CalledProcessError: the writer fails without any fault.
    """
    command = [sys.executable, __file__, name, str(folder), str(kills), str(seed)]
    environment = {**os.environ, "LD_PRELOAD": str(library), "OPENBLAS_NUM_THREADS": "1"}
    subprocess.run(command, env=environment, check=True)
    return Counter(json.loads((folder / "found.json").read_text()))


class Branch:
    """Stops a process at its first step of writing below a folder, once."""

    def __init__(self, place: Path, then: Callable[[], None]) -> None:
        """`then` is called there; the process goes on when it returns."""
        self._place, self._then, self._waits = str(place), then, True
        sys.addaudithook(self._look)

    def _look(self, event: str, given: tuple[Any, ...]) -> None:
        if not self._waits or not event.startswith(("open", "os.mkdir", "os.rename")):
            return
        if event == "open" and not int(given[2] or 0) & (os.O_CREAT | os.O_DIRECTORY):
            return
        if not isinstance(given[0], (str, os.PathLike)):
            return
        if os.fspath(given[0]).startswith(self._place):
            self._waits = False
            self._then()


class Trials:
    """The ends of one writer, each in a fork of a process that is about to write."""

    def __init__(self, writer: Writer, folder: Path, kills: int, seed: int) -> None:
        """Make what the writer rewrites."""
        self._writer, self._folder, self._kills = writer, folder, kills
        self._place = folder / "place"
        self._place.mkdir()
        self._draw = random.Random(seed)
        self.counts: Counter[str] = Counter()
        for _ in range(2):
            self._ended(self._forked(lambda: self._finish()), FIRST_PATIENCE)
            if self._status:
                raise SystemExit(f"{self._said()}\nstatus {self._status} without any fault")
            self._count("broken without any fault", "a run to the end")

    def run(self) -> None:
        """Make all trials, and the run after them."""
        self._writer.prepare(self._place)
        child = os.fork()
        if not child:
            Branch(self._place, self._all)
            self._finish()
        _, status = os.waitpid(child, 0)
        if status:
            raise SystemExit(f"{self._said()}\nthe trials ended with {status}")
        self.counts.update(json.loads((self._folder / "found.json").read_text()))
        self._ended(self._forked(lambda: self._finish()))
        self.counts["left over"] = self._partials()
        (self._folder / "found.json").write_text(json.dumps(self.counts))

    def _all(self) -> None:
        """Continue in forks; return in those only."""
        for _ in self._ends():
            if self._child == 0:
                return
        (self._folder / "found.json").write_text(json.dumps(self.counts))
        os._exit(0)

    def _ends(self) -> Iterator[None]:
        """Yield in each fork after it is prepared, and here when nothing is to be done."""
        begin = time.monotonic()
        yield from self._fork(Stage.ANY, 0)
        if self._child == 0:
            return
        self._ended(self._child)
        lasts = time.monotonic() - begin
        steps = {Stage(int(key)): n for key, n in json.loads(self._steps.read_text()).items()}
        at_steps = _spread(sum(steps.values()), self._kills // 2)
        for call in at_steps:
            yield from self._fork(Stage.ANY, call)
            self._killed(0.0)
        for _ in range(self._kills - len(at_steps)):
            yield from self._fork(Stage.ANY, 0)
            self._killed(self._draw.uniform(0.0, lasts))
        yield from self._fork(Stage.ANY, 0)
        self._ended(self._child)
        for stage in FAILING:
            for call in _spread(steps[stage], FAULTS_A_STAGE):
                yield from self._fork(stage, call)
                self._judge_fault(stage, call)

    @property
    def _steps(self) -> Path:
        return self._folder / "steps.json"

    def _fork(self, stage: Stage, call: int) -> Iterator[None]:
        self._writer.prepare(self._place)
        self._child = os.fork()
        if self._child == 0:
            self._silence()
            arm(self._place, stage, call, errno.ENOSPC)
            yield

    def _killed(self, after: float) -> None:
        """Kill the fork after a time, or wait for it to be killed at its step."""
        if self._child == 0:
            return
        if after:
            time.sleep(after)
            os.kill(self._child, signal.SIGKILL)
        self._ended(self._child)
        self.counts["ended"] += self._status == 0
        self.counts["kills"] += 1
        self._count("broken", "a kill")

    def _judge_fault(self, stage: Stage, call: int) -> None:
        if self._child == 0:
            return
        self._ended(self._child)
        self.counts["faults"] += 1
        what = f"{stage.name.lower()} {call} on a full disk"
        self._count("broken on a full disk", what)
        self._note("left at once", self._partials(), what)
        if self._status == 0:
            self.counts["went on"] += 1
            return
        said = self._said()
        named = str(self._place) in said and SPACE in said.lower() and "free" in said
        self._note("bad message", not named or "Traceback" in said or len(said) > 1000, what)

    def _count(self, name: str, what: str) -> None:
        try:
            whole = self._writer.sound(self._place)
        except Exception as error:
            print(f"  {error!r}", flush=True)
            whole = False
        self._note(name, not whole, what)

    def _note(self, name: str, times: int, what: str) -> None:
        if times and not self.counts[name]:
            print(f"  {name} after {what}: {self._said()[-600:]}", flush=True)
        self.counts[name] += times

    def _partials(self) -> int:
        return sum(".partial" in path.name for path in self._place.rglob("*"))

    def _forked(self, run: Callable[[], object]) -> int:
        self._writer.prepare(self._place)
        child = os.fork()
        if not child:
            self._silence()
            run()
        return child

    def _finish(self) -> NoReturn:
        """Run the writer to its end, and the process with it."""
        status = FAILED
        try:
            status = self._writer.run(self._place)
            self._steps.write_text(json.dumps({int(key): n for key, n in counted().items()}))
        except BaseException:
            import traceback

            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)

    def _silence(self) -> None:
        output = os.open(self._folder / "said", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(output, 1)
        os.dup2(output, 2)

    def _said(self) -> str:
        return (self._folder / "said").read_text(errors="replace")

    def _ended(self, child: int, patience: float = PATIENCE) -> None:
        """Wait for a process; one that hangs is killed and counted."""
        if child == 0:
            return
        end = time.monotonic() + patience
        found, status = os.waitpid(child, os.WNOHANG)
        while not found:
            if time.monotonic() > end:
                os.kill(child, signal.SIGKILL)
                self._note("hung", 1, "a fault")
                end = float("inf")
            time.sleep(0.002)
            found, status = os.waitpid(child, os.WNOHANG)
        self._status = os.waitstatus_to_exitcode(status)


def _spread(count: int, most: int) -> list[int]:
    """Return at most `most` of the numbers from 1 to `count`, evenly spread."""
    if count <= most:
        return list(range(1, count + 1))
    return sorted({round(1 + index * (count - 1) / (most - 1)) for index in range(most)})


if __name__ == "__main__":
    chosen, target, tries, number = sys.argv[1:]
    inputs = Path(target) / "inputs"
    inputs.mkdir()
    trials = Trials(writers(inputs)[chosen], Path(target), int(tries), int(number))
    trials.run()
