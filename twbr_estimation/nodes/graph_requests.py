"""Parameters and services of one robot's nodes, awaited in an asyncio loop."""

from __future__ import annotations

import asyncio
import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, ParameterEvent
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import qos_profile_parameter_events

from ..dashboard.source import ParameterInfo, ShownOutcome, ShownRobot
from ..errors import TwbrError

TIMEOUT = 3.0
"""Time a node may take to answer [s]."""
CHOICES = "one of: "
ENDING = "_node"


class RequestError(TwbrError):
    """A node does not answer."""


class Requests:
    """Asks the nodes of one namespace."""

    def __init__(self, node: Node, space: str) -> None:
        """Ask through `node`, which an executor spins in another thread."""
        self._node, self._space = node, space
        self._parameters: dict[str, AsyncParameterClient] = {}
        self._services: dict[str, Any] = {}
        self._revisions: Counter[str] = Counter()
        node.create_subscription(
            ParameterEvent, "/parameter_events", self._on_event, qos_profile_parameter_events
        )
        self.geometry = ShownRobot()
        """Dimensions from the last parameters that held any."""

    def nodes(self) -> Sequence[str]:
        """Return the nodes of the namespace, ours first, without the page's own."""
        found = {
            name
            for name, space in self._node.get_node_names_and_namespaces()
            if space.rstrip("/") == self._space and not name.startswith(("_", "dashboard_"))
        }
        return sorted(found, key=lambda name: (not name.endswith(ENDING), name))

    def _on_event(self, event: ParameterEvent) -> None:
        space, _, name = event.node.rpartition("/")
        if space == self._space:
            self._revisions[name] += 1

    def revision(self, node: str) -> int:
        """Return a number that changes with the parameters of a node."""
        return self._revisions[node]

    async def parameters(self, node: str) -> Sequence[ParameterInfo]:
        """Return the parameters of a node with value, bounds and text.

        Raises:
            RequestError: the node does not answer.
        """
        client = self._client(node)
        listed = await self._answer(client.list_parameters(), node)
        names = sorted(listed.result.names)
        described = await self._answer(client.describe_parameters(names), node)
        values = await self._answer(client.get_parameters(names), node)
        found = [
            _info(descriptor, parameter_value_to_python(value))
            for descriptor, value in zip(described.descriptors, values.values, strict=True)
        ]
        self._remember({each.name: each.value for each in found})
        return found

    def _remember(self, values: dict[str, Any]) -> None:
        if "robot.wheel_radius" not in values:
            return
        radius = float(values["robot.wheel_radius"])
        height = max(2.0 * float(values.get("robot.body_height", 0.0)), 2.0 * radius)
        width = float(values.get("robot.track_width", 0.0)) or 4.0 * radius
        if all(math.isfinite(each) and each > 0.0 for each in (radius, height, width)):
            self.geometry = ShownRobot(radius, width, height)

    async def set_parameter(self, node: str, name: str, value: Any) -> ShownOutcome:
        """Change a parameter; the outcome has the node's reason where it refuses."""
        try:
            request = Parameter(name, value=value)
            client = self._client(node)
            answer = await self._answer(client.set_parameters([request]), node)
        except TwbrError as error:
            return ShownOutcome(False, f"{name}: {error}")
        except (ValueError, TypeError, AssertionError, OverflowError, AttributeError):
            return ShownOutcome(False, f"{name}: {value!r} is no value of a parameter")
        (result,) = answer.results
        if not result.successful:
            return ShownOutcome(False, f"{name}: {result.reason}")
        return ShownOutcome(True, f"{name} is {value}")

    def is_ready(self, kind: Any, service: str) -> bool:
        """Return whether a node offers the service of this relative name."""
        return bool(self._service(kind, service).service_is_ready())

    async def call(self, kind: Any, service: str, request: Any) -> ShownOutcome:
        """Call a service with `success` and `message` in its answer.

        Raises:
            RequestError: no answer comes.
        """
        client = self._service(kind, service)
        if not client.service_is_ready():
            raise RequestError(f"{service}: nobody serves it")
        answer = await self._answer(client.call_async(request), service, 60.0)
        return ShownOutcome(bool(answer.success), answer.message or service)

    def _service(self, kind: Any, service: str) -> Any:
        if service not in self._services:
            name = f"{self._space}/{service}"
            self._services[service] = self._node.create_client(kind, name)
        return self._services[service]

    def _client(self, node: str) -> AsyncParameterClient:
        if node not in self._parameters:
            self._parameters[node] = AsyncParameterClient(self._node, f"{self._space}/{node}")
        client = self._parameters[node]
        if not client.services_are_ready():
            raise RequestError(f"{node}: its parameters cannot be reached")
        return client

    async def _answer(self, future: Any, who: str, timeout: float = TIMEOUT) -> Any:
        """Wait for a future that an executor completes in its own thread."""
        loop, done = asyncio.get_running_loop(), asyncio.Event()
        future.add_done_callback(lambda _: loop.call_soon_threadsafe(done.set))
        try:
            await asyncio.wait_for(done.wait(), timeout)
        except asyncio.TimeoutError:
            future.cancel()
            raise RequestError(f"{who}: no answer for {timeout:g} s") from None
        return future.result()


def _info(descriptor: ParameterDescriptor, value: Any) -> ParameterInfo:
    minimum = maximum = None
    for limits in (*descriptor.floating_point_range, *descriptor.integer_range):
        minimum, maximum = limits.from_value, limits.to_value
    text = descriptor.additional_constraints
    choices = tuple(text.removeprefix(CHOICES).split(", ")) if text.startswith(CHOICES) else ()
    plain = list(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
    return ParameterInfo(
        descriptor.name,
        plain,
        descriptor.description,
        minimum,
        maximum,
        choices,
        bool(descriptor.read_only),
    )
