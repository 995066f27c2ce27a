"""Errors in callbacks: counted, said in one line, and the node goes on."""

from __future__ import annotations

import subprocess
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from twbr_estimation.nodes.diagnostics import Diagnostics, Level, Report
from twbr_estimation.nodes.guard import GuardedNode
from twbr_estimation.nodes.lifecycle import DeviceNode
from twbr_estimation.streams.messages import decode_float64


class Faulty(GuardedNode):
    """Every callback of it raises."""

    def __init__(self, **options: Any) -> None:
        super().__init__("faulty", **options)
        self.create_subscription(Float64, "number", self.fail, 10)
        self.create_service(Trigger, "~/work", self.fail)
        self.create_timer(0.01, self.fail)
        self.declare_parameter("number", 1.0)
        self.add_on_set_parameters_callback(self.fail)
        Diagnostics(self, lambda: Report(Level.OK, "all is well", {}), period=0.05)

    def fail(self, *arguments: Any) -> None:
        raise ZeroDivisionError(f"after {len(arguments)} arguments")


def test_a_message_that_cannot_be_decoded_is_only_counted(graph: Any) -> None:
    node = graph.add(GuardedNode("reader", **graph.options()))
    read: list[float] = []
    take = node.guarded("number", lambda data: read.append(decode_float64(data)))
    take(b"\0\1\0\0")
    take(serialize_message(Float64(data=2.0)))
    assert read == [2.0] and node.unreadable == 1 and not node.callback_errors.counts


def test_no_kind_of_callback_ends_a_node(graph: Any) -> None:
    node = graph.add(Faulty(**graph.options()))
    number = graph.probe.create_publisher(Float64, "number", 10)
    reports = graph.collect(DiagnosticArray, "/diagnostics")
    graph.settle()
    number.publish(Float64())
    answer = graph.call(Trigger, "/faulty/work", Trigger.Request())
    assert not answer.success and "ZeroDivisionError" in answer.message
    request = SetParameters.Request(parameters=[Parameter("number", value=2.0).to_parameter_msg()])
    (result,) = graph.call(SetParameters, "/faulty/set_parameters", request).results
    assert not result.successful and "ZeroDivisionError" in result.reason
    assert node.get_parameter("number").value == 1.0
    counts = node.callback_errors.counts
    graph.spin_until(
        lambda: all(counts[each] for each in ("number", "timer fail", "service ~/work"))
    )

    def reported() -> int:
        values = [each for status in reports[-1].status for each in status.values]
        return sum(int(each.value) for each in values if each.key == "callback_errors")

    graph.spin_until(lambda: len(reports) > 0 and reported() > 2)
    (status,) = reports[-1].status
    assert status.level == Level.WARN.value and "all is well" in status.message
    assert "ZeroDivision" in status.message and "test_guard.py" in status.message


def test_a_clock_before_its_beginning_ends_no_node(graph: Any) -> None:
    node = graph.add(GuardedNode("subject", **graph.options(use_sim_time=True)))
    clock = graph.probe.create_publisher(Clock, "/clock", 10)
    graph.settle()
    bad, good = Clock(), Clock()
    bad.clock.sec, good.clock.sec = -5, 7
    clock.publish(bad)
    graph.spin_until(lambda: node.callback_errors.counts["/clock"] == 1)
    clock.publish(good)
    graph.spin_until(lambda: node.get_clock().now().nanoseconds == 7_000_000_000)


def test_text_that_is_not_utf8_ends_no_process(python: str, graph: Any) -> None:
    """rclpy converts a message before the callback; its error comes out of the executor."""
    program = (
        "import sys; from geometry_msgs.msg import TwistStamped\n"
        "from twbr_estimation.nodes.guard import GuardedNode\n"
        "from twbr_estimation.nodes.spin import run\n"
        "class Subject(GuardedNode):\n"
        "    def __init__(self):\n"
        "        super().__init__('subject')\n"
        "        self.create_subscription(TwistStamped, 'twist', self.take, 10)\n"
        "    def take(self, message):\n"
        "        print('came', flush=True); raise SystemExit(0)\n"
        "sys.exit(run(Subject))\n"
    )
    process = subprocess.Popen([python, "-c", program], stdout=subprocess.PIPE, text=True)
    publisher = graph.probe.create_publisher(TwistStamped, "twist", 10)
    graph.spin_until(lambda: publisher.get_subscription_count() == 1)
    frame = b"\x05\x00\x00\x00\xff\xfe\xfd\xfc\x00"
    publisher.publish(b"\x00\x01\x00\x00" + bytes(8) + frame + bytes(3 + 48))
    publisher.publish(TwistStamped())
    output, _ = process.communicate(timeout=20)
    assert (process.returncode, output) == (0, "came\n"), (
        "the second message ends it, not the first"
    )


class Device(DeviceNode):
    """A device that is always there."""

    def __init__(self, **options: Any) -> None:
        super().__init__("device", **options)
        self.begin()

    def open_device(self) -> None:
        pass

    def close_device(self) -> None:
        pass


IDS = [*range(9), 50, 255]


@pytest.mark.parametrize("autostart", [True, False])
def test_no_transition_ends_a_lifecycle_node(graph: Any, autostart: bool) -> None:
    graph.add(Device(**graph.options(autostart=autostart)))
    client = graph.probe.create_client(ChangeState, "/device/change_state")
    graph.spin_until(client.service_is_ready)

    def state() -> str:
        answer = graph.call(GetState, "/device/get_state", GetState.Request())
        return str(answer.current_state.label)

    possible = {"unconfigured": {1, 5}, "inactive": {2, 3, 6}, "active": {4, 7}, "finalized": set()}
    for number in [*IDS, 1, 3, *IDS, 1, 2, *reversed(IDS)]:
        before = state()
        future = client.call_async(ChangeState.Request(transition=Transition(id=number)))
        graph.spin_until(future.done)
        assert future.result().success == (number in possible[before]), (before, number)
    assert state() == "finalized"
    request = ChangeState.Request(transition=Transition(label="no such label"))
    assert not graph.call(ChangeState, "/device/change_state", request).success
