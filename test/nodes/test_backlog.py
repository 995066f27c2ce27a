"""A node that cannot keep up drops messages before its timers starve."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")

from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import HistoryPolicy, QoSProfile
from sensor_msgs.msg import Imu

from twbr_estimation.nodes.backlog import Backlog
from twbr_estimation.nodes.diagnostics import Diagnostics, Level, Report
from twbr_estimation.nodes.guard import GuardedNode

TICK, DEPTH = 0.05, 100


class FakeTimer:
    """A timer that runs until it is cancelled."""

    cancelled = False

    def is_canceled(self) -> bool:
        return self.cancelled


class Queue:
    """Events of an executor that are served in their order, in the time of a test."""

    def __init__(self, depth: int = DEPTH) -> None:
        self.time, self.depth = 0.0, depth
        self.backlog = Backlog(lambda: self.time)
        self.timer = FakeTimer()
        self.backlog.add_timer(TICK, self.timer)
        self.backlog.add_queue("a", QoSProfile(depth=depth))
        self.backlog.begin()
        self.waits: list[float] = []
        self.handled = 0

    def run(self, rate: float, cost: float, lasts: float, pause: float = 0.0) -> None:
        """Let messages come at `rate` [1/s], each handled in `cost` [s], for `lasts` [s].

        An event is queued for each of them, but of the messages only the last `depth` are kept.
        Half-way the node stands still for `pause` [s].
        """
        events: list[tuple[float, bool]] = []
        come, kept, due, last = 0, 0, TICK, 0.0
        while self.time < lasts:
            if self.time > 0.5 * lasts:
                self.time, pause = self.time + pause, 0.0
            while come / rate <= self.time:
                events.append((come / rate, False))
                come, kept = come + 1, min(kept + 1, self.depth)
            if due is not None and due <= self.time:
                events.append((due, True))
                due = None
            if not events:
                self.time += 0.0005
                continue
            _, is_tick = events.pop(0)
            if is_tick:
                self.backlog.ticked(TICK)
                self.waits.append(self.time - last)
                last, due = self.time, self.time + TICK
            elif kept:
                kept -= 1
                drops = self.backlog.drops()
                self.handled += not drops
                self.time += 2e-5 if drops else cost


def test_a_node_that_keeps_up_drops_nothing() -> None:
    queue = Queue()
    queue.run(rate=1000.0, cost=0.0008, lasts=20.0)
    assert queue.backlog.dropped == 0 and len(queue.waits) > 300


def test_a_timer_gets_its_turn_however_many_messages_come() -> None:
    queue = Queue()
    queue.run(rate=1000.0, cost=0.003, lasts=60.0)
    assert max(queue.waits) < 1.0
    assert queue.handled * 0.003 / 60.0 > 0.9, "what can be handled is"


def test_what_queues_can_hold_is_handled_after_a_pause() -> None:
    queue = Queue()
    queue.run(rate=100.0, cost=0.001, lasts=5.0)
    queue.time += 30.0  # stopped by a debugger, or by the system
    for _ in range(DEPTH):
        assert not queue.backlog.drops()
    assert any(queue.backlog.drops() for _ in range(DEPTH)), "more than a queue can hold"
    queue.backlog.ticked(TICK)
    assert not queue.backlog.drops(), "the timer has had its turn"


@pytest.mark.parametrize("others", [[], [FakeTimer()]])
def test_a_timer_that_was_cancelled_is_not_waited_for(others: list[FakeTimer]) -> None:
    queue = Queue()
    for timer in others:
        queue.backlog.add_timer(1.0, timer)
    queue.timer.cancelled = True
    queue.time = 10.0
    assert not any(queue.backlog.drops() for _ in range(100 * DEPTH))


def test_one_pause_costs_a_node_that_keeps_up_little() -> None:
    queue = Queue()
    queue.run(rate=1000.0, cost=0.0003, lasts=20.0, pause=2.0)
    assert queue.backlog.dropped < DEPTH


def test_a_queue_without_an_end_is_never_dropped_from() -> None:
    queue = Queue()
    everything = QoSProfile(history=HistoryPolicy.KEEP_ALL)
    queue.backlog.add_queue("b", everything)
    queue.time = 100.0
    assert not any(queue.backlog.drops() for _ in range(10_000))


def test_reports_come_between_messages_and_say_what_was_dropped(graph: Any) -> None:
    node = graph.add(GuardedNode("slow", **graph.options()))
    diagnostics = Diagnostics(node, lambda: Report(Level.OK, "fine", {}), period=0.001)
    diagnostics._timer.cancel()
    node.backlog._timers = [(0.001, FakeTimer())]
    taken: list[bytes] = []
    node.create_subscription(Imu, "ticks", taken.append, QoSProfile(depth=2), raw=True)
    found = graph.collect(DiagnosticArray, "/diagnostics")
    graph.settle()
    node.backlog._due = -1.0  # due long ago
    node.backlog._period = 0.001
    callback = next(each.callback for each in node.subscriptions if each.topic_name == "/ticks")
    for _ in range(10):
        callback(b"")
    assert len(taken) == 2 and node.backlog.dropped == 8
    graph.spin_until(lambda: any(each.status[0].name == "slow" for each in found))
    node.backlog.ticked(0.001)
    diagnostics.update()
    graph.spin_until(lambda: any("too slow" in each.status[0].message for each in found))
    last = [each.status[0] for each in found if each.status[0].name == "slow"][-1]
    assert {item.key: item.value for item in last.values}["messages_dropped"] == "8"
