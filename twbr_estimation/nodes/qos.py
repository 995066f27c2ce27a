"""Quality of service of every topic, in one place.

Publishers are reliable and data subscriptions best effort: the only mix that can talk to
every peer. Both can be changed for each topic by the standard parameters
`qos_overrides.TOPIC.publisher|subscription.history|depth|reliability`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

DEPTH = 100
"""Messages a queue holds: 0.1 s at 1 kHz, so that a scheduling hiccup loses nothing."""


def published() -> QoSProfile:
    """Return the quality of service of data we publish.

    A new object at each call: rclpy writes the overrides of one topic into the profile it
    is given, and a shared one would carry them to every later topic of the process.
    """
    return QoSProfile(depth=DEPTH, reliability=ReliabilityPolicy.RELIABLE)


def subscribed() -> QoSProfile:
    """Return the quality of service of data we listen to."""
    return QoSProfile(depth=DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT)


def latched() -> QoSProfile:
    """Return that of states which a late subscriber must see, such as `tilt/valid`."""
    return QoSProfile(
        depth=1,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )


def diagnostics() -> QoSProfile:
    """Return that of `/diagnostics`, reliable as its usual readers expect it."""
    return QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)


def overridable() -> QoSOverridingOptions:
    """Return the option that lets parameters change a topic's quality of service."""
    return QoSOverridingOptions.with_default_policies()


def listen(node: Node, kind: Any, topic: str, callback: Callable[[bytes], None]) -> Any:
    """Subscribe to serialised messages."""
    return node.create_subscription(
        kind, topic, callback, subscribed(), qos_overriding_options=overridable(), raw=True
    )
