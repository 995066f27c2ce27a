"""The transform that a controller on TF reads, with a stand-in where tf2_msgs is missing."""

from __future__ import annotations

import math
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from twbr_estimation.nodes.tilt_transform import TiltTransform


class TFMessage:
    """The one field of tf2_msgs/TFMessage."""

    def __init__(self, transforms: list[Any]) -> None:
        self.transforms = transforms


class StandIn:
    """A node as far as `TiltTransform` needs one."""

    def __init__(self, **parameters: Any) -> None:
        self.parameters, self.sent = parameters, []
        self._parameter_overrides: dict[str, Any] = {}

    def _set_parameters_atomically_common(self, parameters: Any, *_: Any) -> Any:
        for each in parameters:
            self.parameters.setdefault(each.name, each.value)
        return SimpleNamespace(successful=True)

    def get_parameter(self, name: str) -> Any:
        return SimpleNamespace(value=self.parameters[name])

    def create_publisher(self, kind: Any, topic: str, depth: int) -> Any:
        assert (kind, topic) == (TFMessage, "/tf") and depth > 0
        return SimpleNamespace(publish=lambda message: self.sent.append(message.transforms[0]))


def pitch_of(transform: Any) -> float:
    """What a controller makes of a transform: the pitch of its rotation."""
    q = transform.transform.rotation
    return math.asin(2.0 * (q.w * q.y - q.z * q.x))


def test_a_controller_on_tf_finds_the_tilt(monkeypatch: pytest.MonkeyPatch) -> None:
    package, messages = ModuleType("tf2_msgs"), ModuleType("tf2_msgs.msg")
    messages.TFMessage = TFMessage  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "tf2_msgs", package)
    monkeypatch.setitem(sys.modules, "tf2_msgs.msg", messages)
    node = StandIn(publish_tf=True, tf_parent="odom", tf_child="base_link")
    transform = TiltTransform(node)  # type: ignore[arg-type]
    for index, tilt in enumerate((-0.4, 0.0, 0.25)):
        transform.publish(7_000_000_000 + index, tilt)
        (sent,) = node.sent[index:]
        assert (sent.header.frame_id, sent.child_frame_id) == ("odom", "base_link")
        assert (sent.header.stamp.sec, sent.header.stamp.nanosec) == (7, index)
        assert pitch_of(sent) == pytest.approx(tilt)
    assert transform.problem == ""


def test_unasked_it_publishes_nothing() -> None:
    node = StandIn()
    transform = TiltTransform(node)  # type: ignore[arg-type]
    transform.publish(1, 0.1)
    assert node.sent == [] and transform.problem == ""
