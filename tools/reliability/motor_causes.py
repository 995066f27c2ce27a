"""Causes for which a controller has to stop the motors, brought about for a real process.

`tried` feeds a controller until it drives, lets a cause begin and end, then feeds a robot that
leans, and at last one that has been stood up. An independent client counts the commands.
"""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Any, NamedTuple

from std_msgs.msg import Bool

from reliability.fed_controller import PERIOD, FedController
from reliability.set_clock import SetClock

LIMIT = 0.055
"""`tilt_timeout` plus one `period`, the defaults [s]."""
LEANING = 0.3
"""A tilt of a robot that has not fallen but is not stood up either [rad]."""
HOLD, LEAN = 0.5, 0.3
"""How long a cause lasts, and how long the robot leans afterwards [s]."""
RETURN = 3.0
"""Within this time a robot that is stood up is balanced again [s]."""
CLOCK_STEP = 10.0
"""How far the clock is set [s]."""
WHEEL_LIMIT = 0.105
"""`wheel_timeout` plus one `period` [s]."""
PROGRAM = "import sys; from twbr_estimation.nodes.controller_node import main; sys.exit(main())"


class Controller:
    """A controller's process, what feeds it, and its clock."""

    def __init__(
        self,
        graph: Any,
        clock: SetClock | None = None,
        program: str = PROGRAM,
        command: Sequence[str] = (),
        arguments: Sequence[str] = (),
        terminal: int | None = None,
        simulated_time: bool | None = None,
    ) -> None:
        """Start it.

        Args:
            graph: As of `FedController`.
            clock: What sets its clock; None leaves that alone.
            program: The Python program of the controller.
            command: A command that starts it, such as `unshare`.
            arguments: Those after `--ros-args`.
            terminal: Descriptor of a terminal it runs on; None gives it a session without one.
            simulated_time: Whether to publish `/clock`; None where the arguments ask for it.
        """
        if simulated_time is None:
            simulated_time = "use_sim_time:=true" in arguments
        self.clock, self.robot = clock, FedController(graph, simulated_time)
        call = [*command, sys.executable, "-c", program, "--ros-args", *arguments]
        environment = os.environ | (clock.environment if clock else {})
        if terminal is None:
            self.process = subprocess.Popen(
                call, env=environment, stderr=subprocess.DEVNULL, start_new_session=True
            )
        else:
            self.process = subprocess.Popen(
                call, env=environment, preexec_fn=lambda: os.login_tty(terminal)
            )

    def set_clock(self, seconds: float) -> None:
        """Set its clock; needs one."""
        assert self.clock is not None
        self.clock.set(seconds)

    def stop(self) -> None:
        """Stop the process for a while."""
        self.process.send_signal(signal.SIGSTOP)

    def go_on(self) -> None:
        """Let a stopped process go on."""
        self.process.send_signal(signal.SIGCONT)

    def say_valid(self, valid: bool) -> None:
        """Publish `tilt/valid`."""
        self.robot.valid.publish(Bool(data=valid))

    def close(self) -> None:
        """End the process."""
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait(10.0)


@contextmanager
def controller(graph: Any, **options: Any) -> Iterator[Controller]:
    """Yield a controller that drives; end it afterwards."""
    made = Controller(graph, **options)
    try:
        made.robot.until(made.robot.drives, 60.0)
        yield made
    finally:
        made.close()


def _nothing(controller: Controller) -> None:
    pass


class Cause(NamedTuple):
    """What happens, and what is fed meanwhile."""

    name: str
    feed: Mapping[str, Any] | None = None
    """Arguments of `FedController.feed`; None feeds nothing."""
    begin: Callable[[Controller], None] = _nothing
    end: Callable[[Controller], None] = _nothing
    answers: bool = True
    """Whether the controller can command anything meanwhile."""
    limit: float = LIMIT
    """Time within which the zeros come [s]."""


class Outcome(NamedTuple):
    """What the client saw."""

    stopped: float
    """From the cause to the zeros after which nothing drives [s]; infinity without them."""
    driving: int
    """Commands that drive and came after the cause."""
    zeros: int
    """Commands of zeros while the cause lasted."""
    early: int
    """Commands that drive after it, before the robot was stood up."""
    back: float
    """From then to the first command that drives [s]; infinity without one."""


def tilts_at_fault() -> list[Cause]:
    """Return what can be wrong with what a controller gets."""
    return [
        Cause("no tilt comes"),
        Cause("tilts 0.2 s late", {"age": 0.2}),
        Cause("tilts 1 s old by their stamps", {"age": 1.0}),
        Cause("tilts 2 s ahead", {"age": -2.0}),
        Cause("tilts of another clock", {"age": 1e6}),
        Cause("a frozen tilt", {"frozen": True}),
        Cause("tilts that are no numbers", {"lean": math.nan}),
        Cause("no wheels", {"wheels": False}, limit=WHEEL_LIMIT),
        Cause(
            "tilt/valid is false",
            {},
            lambda made: made.say_valid(False),
            lambda made: made.say_valid(True),
        ),
        Cause("the controller stopped", {}, Controller.stop, Controller.go_on, answers=False),
    ]


def clocks_set() -> list[Cause]:
    """Return the ways to set a clock: the controller's alone, or the whole computer's."""
    return [
        Cause(
            f"{whose} set {way}",
            {"lean": LEANING, "age": -step if whose == "the computer's clock" else 0.0},
            lambda made, step=step: made.set_clock(step),  # type: ignore[misc]
            lambda made: made.set_clock(0.0),
        )
        for whose in ("the controller's clock", "the computer's clock")
        for way, step in (("back by 10 s", -CLOCK_STEP), ("forward by 10 s", CLOCK_STEP))
    ]


def tried(made: Controller, cause: Cause) -> Outcome:
    """Let a cause happen to a controller that drives; return what the client saw."""
    robot = made.robot
    robot.until(robot.drives)
    start, first = time.monotonic(), len(robot.commands)
    cause.begin(made)
    _fed(robot, HOLD, cause.feed)
    over, middle = time.monotonic(), len(robot.commands)
    cause.end(made)
    _fed(robot, LEAN, {"lean": LEANING})
    stood, last = time.monotonic(), len(robot.commands)
    with suppress(TimeoutError):
        robot.until(robot.drives, 10.0 * RETURN)
    during, between = robot.commands[first:middle], robot.commands[middle:last]
    after = [at for at, each, _ in robot.commands[last:] if any(each)]
    return Outcome(
        _stopped(during) - start,
        sum(any(each) for _, each, _ in during),
        sum(not any(each) for _, each, _ in during),
        sum(any(each) for at, each, _ in between if at > over),
        min(after, default=math.inf) - stood,
    )


def _stopped(commands: Sequence[tuple[float, tuple[float, ...], int]]) -> float:
    """Return when the zeros came after which nothing drives [s]; infinity without them."""
    since = math.inf
    for at, each, _ in commands:
        since = math.inf if any(each) else min(since, at)
    return since


def _fed(robot: FedController, seconds: float, how: Mapping[str, Any] | None) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if how is None:
            robot.wait(PERIOD)
        else:
            robot.feed(**how)
