"""Inputs of correction and filter: their common parameters and raw subscriptions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node

from ..streams.inputs import InputSettings
from .declarations import Declaration, declarations_of, settings_from
from .parameters import NodeParameters
from .qos import overridable, subscribed

IMU_FRAME = Declaration(
    "frame_id", "imu_link", "Frame of the Imu messages that are published.", read_only=True
)


def declare_inputs(node: Node) -> InputSettings:
    """Declare the read-only parameters of the inputs and return their values.

    Raises:
        ConfigurationError: a value out of bounds.
    """
    declared = declarations_of(InputSettings(), read_only=True)
    return NodeParameters(
        node, declared, lambda values: settings_from(InputSettings(), values)
    ).current


def listen(node: Node, kind: Any, topic: str, callback: Callable[[bytes], None]) -> Any:
    """Subscribe to serialised messages."""
    return node.create_subscription(
        kind, topic, callback, subscribed(), qos_overriding_options=overridable(), raw=True
    )
