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

from twbr_estimation.configuration.files import write_section  # noqa: E402
from twbr_estimation.controllers import listed_controllers  # noqa: E402
from twbr_estimation.errors import TwbrError  # noqa: E402
from twbr_estimation.filters import listed_filters  # noqa: E402
from twbr_estimation.robot import Robot  # noqa: E402
from twbr_estimation.simulation.simulate import setups_of  # noqa: E402
from twbr_estimation.simulation.worlds import world_named  # noqa: E402

PUSH = 3.0
"""Force of one key [N]."""
FASTER = 0.1
"""Change of the commanded speed with one key [m/s]."""
FASTEST = 0.4
"""[m/s]."""
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


class Watcher:
    """Subscribes to the graph, and sends the commands of the keys."""

    def __init__(self, shown: Shown) -> None:
        """Join the graph; `shown` is kept up to date."""
        import rclpy
        from geometry_msgs.msg import TwistStamped
        from rclpy.parameter_client import AsyncParameterClient
        from sensor_msgs.msg import Imu, JointState
        from std_msgs.msg import Float64, Float64MultiArray
        from std_srvs.srv import Trigger

        rclpy.init()
        self._rclpy, self._twist, self._trigger = rclpy, TwistStamped, Trigger
        self._shown = shown
        self._node = node = rclpy.create_node("balance_view")
        from twbr_estimation.nodes.spin import make_executor

        self._executor = make_executor()
        self._executor.add_node(node)
        listen = node.create_subscription
        listen(JointState, "reference/joint_states", self._on_reference, 10)
        listen(JointState, "joint_states", self._on_wheels, 10)
        listen(Imu, "imu/data", self._on_imu, 10)
        listen(Float64MultiArray, "motor/command", self._on_command, 10)
        listen(Float64, "evaluator_node/active/mse_deg2", self._on_mse, 10)
        self._listen_to_diagnostics()
        self._push = node.create_client(Trigger, "simulator_node/push")
        self._drive = node.create_publisher(TwistStamped, "cmd_vel", 10)
        self._reset = node.create_client(Trigger, "evaluator_node/reset")
        self._parameters = {
            name: AsyncParameterClient(node, f"{name}_node")
            for name in ("filter", "controller", "simulator")
        }
        self._last_wheel: tuple[float, float] | None = None

    def _listen_to_diagnostics(self) -> None:
        from diagnostic_msgs.msg import DiagnosticArray

        def take(message: DiagnosticArray) -> None:
            for status in message.status:
                if status.name == "controller_node":
                    balancing = status.message.startswith("balancing")
                    self._shown.standing = "balancing" if balancing else status.message
                    if not self._can_be_asked():
                        self._shown.standing = "waiting for the nodes' services"

        self._node.create_subscription(DiagnosticArray, "/diagnostics", take, 10)

    def _can_be_asked(self) -> bool:
        """Return whether a key would reach its node: a request before that is lost."""
        asked = (self._push, self._reset)
        return all(each.service_is_ready() for each in asked) and all(
            each.services_are_ready() for each in self._parameters.values()
        )

    def _on_reference(self, message: Any) -> None:
        self._shown.reference = math.degrees(message.position[0])

    def _on_wheels(self, message: Any) -> None:
        now = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
        turned = sum(message.position) / len(message.position)
        tilt = math.radians(self._shown.reference)
        way = Robot().wheel_radius * (turned + (0.0 if math.isnan(tilt) else tilt))
        last, self._last_wheel = self._last_wheel, (now, way)
        if last is not None and now > last[0]:
            speed, before = (way - last[1]) / (now - last[0]), self._shown.speed
            self._shown.speed = speed if math.isnan(before) else before + 0.05 * (speed - before)

    def _on_imu(self, message: Any) -> None:
        q = message.orientation
        self._shown.estimate = math.degrees(2.0 * math.atan2(q.y, q.w))

    def _on_command(self, message: Any) -> None:
        self._shown.voltage = sum(message.data) / len(message.data)

    def _on_mse(self, message: Any) -> None:
        self._shown.mse = message.data

    def spin(self, seconds: float) -> None:
        """Let messages in for a while."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def repeat_command(self) -> None:
        """Send the commanded speed again, as a joystick would."""
        message = self._twist()
        message.twist.linear.x = self._shown.target
        self._drive.publish(message)

    def act(self, key: str) -> None:
        """Do what a key means."""
        shown = self._shown
        if key in "ad":
            self._pushed(PUSH if key == "d" else -PUSH)
        elif key in "ws ":
            step = {"w": FASTER, "s": -FASTER, " ": -shown.target}[key]
            shown.target = min(max(shown.target + step, -FASTEST), FASTEST)
            shown.message = f"driving at {shown.target:+.1f} m/s"
        elif key in "fF":
            self._switch("filter", next_of(listed_filters(), shown.filter, key == "F"))
        elif key in "cC":
            self._switch("controller", next_of(listed_controllers(), shown.controller, key == "C"))

    def _pushed(self, force: float) -> None:
        from rclpy.parameter import Parameter

        change = [Parameter("push_force", value=force)]
        done = self._parameters["simulator"].set_parameters(change)
        done.add_done_callback(lambda _: self._push.call_async(self._trigger.Request()))
        self._shown.message = f"pushed by {force:+g} N"

    def _switch(self, what: str, name: str) -> None:
        from rclpy.parameter import Parameter

        future = self._parameters[what].set_parameters([Parameter(what, value=name)])
        self._shown.message = f"switching to {name} ..."

        def answered(done: Any) -> None:
            (result,) = done.result().results
            if not result.successful:
                self._shown.message = f"{name}: {result.reason}"
                setattr(self._shown, what, name)  # so that the next key goes past it
                return
            setattr(self._shown, what, name)
            self._shown.message = f"{what} {name}"
            if what == "filter":
                self._reset.call_async(self._trigger.Request())
                self._shown.mse = math.nan

        future.add_done_callback(answered)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._rclpy.try_shutdown()


def next_of(names: Any, current: str, backwards: bool) -> str:
    """Return the name after the current one, or before it, around the end."""
    found = list(names)
    at = found.index(current) if current in found else -1
    return str(found[(at + (-1 if backwards else 1)) % len(found)])


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
