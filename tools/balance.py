"""See the whole robot balance without hardware: every node in a process, and a page to watch.

Run by `make balance`, which opens the page of `dashboard_node` in the browser. With `--terminal`,
as over ssh, the robot is shown in the terminal: keys push and drive it, and switch filter and
controller. Without a terminal it prints a line a second and ends after `--seconds`.
"""

from __future__ import annotations

import argparse
import math
import os
import select
import signal
import socket
import sys
import tempfile
import termios
import time
import tty
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from balance_view import SECONDS_A_COLUMN, Shown, page
from node_processes import Graph
from rich.live import Live

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from balance_watcher import Watcher  # noqa: E402

from twbr_estimation.configuration.files import write_section  # noqa: E402
from twbr_estimation.errors import TwbrError  # noqa: E402
from twbr_estimation.simulation.simulate import setups_of  # noqa: E402
from twbr_estimation.simulation.worlds import world_named  # noqa: E402

SIMULATOR = {"imu_period": 0.005, "duration": 20.0, "stay_down": False}
"""Slow and short, so that it starts soon; a fallen robot is stood up by itself."""
START_TIMEOUT = 30.0
"""Longest time until the robot stands [s]."""
ARROWS = {"\x1b[A": "w", "\x1b[B": "s", "\x1b[C": "d", "\x1b[D": "a"}


@contextmanager
def keyboard() -> Iterator[Any]:
    """Yield a function that returns the keys pressed; the terminal is as before afterwards."""
    terminal = sys.stdin.fileno()
    before = termios.tcgetattr(terminal)

    def pressed() -> list[str]:
        if not select.select([terminal], [], [], 0.0)[0]:
            return []
        text = os.read(terminal, 64).decode(errors="ignore")
        for sequence, key in ARROWS.items():
            text = text.replace(sequence, key)
        return list(text)

    try:
        tty.setcbreak(terminal)
        yield pressed
    finally:
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


def start(graph: Graph, folder: Path, arguments: argparse.Namespace) -> None:
    """Start robot, estimation, controller and evaluator."""
    world = world_named(arguments.world)
    setup, _ = setups_of(world, arguments.seed)
    files = [folder / "robot.yaml", folder / "calibration.yaml"]
    write_section(files[0], setup.robot)
    write_section(files[1], setup.calibration)
    chosen: dict[str, object] = {"filter": arguments.filter, "drivers": False}
    robot = {"world": world.name, "seed": arguments.seed, "disturbed": arguments.disturbed}
    graph.start("simulator_node", {**robot, **SIMULATOR})
    graph.start("estimation_node", chosen, files)
    graph.start("controller_node", {"controller": arguments.controller}, files)
    graph.start("evaluator_node", {"table": False, "period": 0.5})


def watch(graph: Graph, watcher: Watcher, shown: Shown, seconds: float) -> Iterator[None]:
    """Yield whenever there is something new to show, until the time with estimates is over.

    Raises:
        RuntimeError: a node ended, or there is no estimate.
    """
    created, begin = time.monotonic(), None
    while shown.time < seconds:
        watcher.spin(SECONDS_A_COLUMN)
        watcher.repeat_command()
        graph.check()
        now = time.monotonic()
        if begin is None and not math.isnan(shown.estimate + shown.reference):
            begin = now
        if begin is not None:
            shown.take_time(now - begin)
            shown.history.append((shown.reference, shown.estimate))
        elif now - created > START_TIMEOUT:
            raise RuntimeError(f"there is no estimate after {START_TIMEOUT:g} s")
        yield


def run_on_terminal(graph: Graph, watcher: Watcher, shown: Shown, seconds: float) -> None:
    """Show pages and take keys, until `q` or the time is over."""
    with keyboard() as pressed, Live(screen=True, auto_refresh=False) as live:
        for _ in watch(graph, watcher, shown, seconds):
            for key in pressed():
                if key in "qQ\x04":
                    return
                watcher.act(key)
            live.update(page(shown), refresh=True)


def run_on_page(graph: Graph, port: int, seconds: float) -> None:
    """Serve the page, open it in the browser, and wait for Ctrl-C or until the time is over.

    Raises:
        RuntimeError: a node ended, or the page cannot be opened.
    """
    address, begin = f"http://127.0.0.1:{port}/", time.monotonic()
    graph.start("dashboard_node", {"port": port})
    while not _answers(port):
        graph.check()
        if time.monotonic() - begin > START_TIMEOUT:
            raise RuntimeError(f"{address} does not open after {START_TIMEOUT:g} s")
        time.sleep(0.2)
    print(f"The robot is at {address}\nCtrl-C ends it; --terminal shows it here.", flush=True)
    webbrowser.open(address)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        graph.check()
        time.sleep(0.2)


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        probe.settimeout(0.5)
        return probe.connect_ex(("127.0.0.1", port)) == 0


def run_on_lines(graph: Graph, watcher: Watcher, shown: Shown, seconds: float) -> None:
    """Print a line a second until the time is over."""
    due = 0.0
    for _ in watch(graph, watcher, shown, seconds):
        if shown.history and shown.time >= due:
            due += 1.0
            print(shown.line(), flush=True)


def parsed() -> argparse.Namespace:
    """Return the command line."""
    parser = argparse.ArgumentParser(description="See the simulated robot balance.")
    parser.add_argument("--world", default="paper", help="default: %(default)s")
    parser.add_argument("--seed", type=int, default=1, help="default: %(default)s")
    parser.add_argument("--filter", default="ins_odometer", help="default: %(default)s")
    parser.add_argument("--controller", default="pid", help="default: %(default)s")
    parser.add_argument("--disturbed", action="store_true", help="pushes and obstacles by chance")
    parser.add_argument("--terminal", action="store_true", help="show it here, not in the browser")
    parser.add_argument("--port", type=int, default=8080, help="of the page; default: %(default)s")
    parser.add_argument("--seconds", type=float, help="default: until q, or 10 without a terminal")
    return parser.parse_args()


def main() -> int:
    """Run the graph and show it; return 0 where the robot was upright to the end, or `q`."""
    arguments = parsed()
    for number in (signal.SIGINT, signal.SIGTERM):  # also where a script started it, which ignores
        signal.signal(number, signal.default_int_handler)  # the first one
    if find_spec("rclpy") is None:
        print("balance: error: this needs ROS 2: pip install .[ros]", file=sys.stderr)
        return 1
    on_terminal = sys.stdin.isatty() and sys.stdout.isatty()
    on_page = on_terminal and not arguments.terminal and find_spec("nicegui") is not None
    seconds = arguments.seconds or (math.inf if on_terminal else 10.0)
    shown = Shown(filter=arguments.filter, controller=arguments.controller)
    watcher = None
    with tempfile.TemporaryDirectory() as folder:
        graph = Graph(Path(folder))
        os.environ["ROS_DOMAIN_ID"] = str(graph.domain)
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        try:
            start(graph, Path(folder), arguments)
            if on_page:
                run_on_page(graph, arguments.port, seconds)
                return 0
            watcher = Watcher(shown)
            (run_on_terminal if on_terminal else run_on_lines)(graph, watcher, shown, seconds)
        except KeyboardInterrupt:
            if on_page:
                return 0
        except (RuntimeError, TwbrError) as error:
            print(f"balance: error: {error}", file=sys.stderr)
            return 1
        finally:
            graph.close()
            if watcher is not None:
                watcher.close()
    print(shown.line())
    return 0 if shown.upright_since is not None else 1


if __name__ == "__main__":
    sys.exit(main())
