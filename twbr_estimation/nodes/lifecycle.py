"""Managed nodes, also those that open a device: transitions, autostart, recovery."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.timer import Timer

from ..errors import TwbrError
from ..streams.callback_errors import LOG_PERIOD, described
from .declarations import Declaration
from .diagnostics import Level, Report
from .guard import Guard
from .parameters import declare
from .watchdog import wall_timer

RETRY_PERIOD = 2.0
"""Time between two attempts of a node with `autostart` [s]."""
SETTLING_TIME = 0.5
"""Time after activation within which silence is no fault [s]."""


class ManagedNode(Guard, LifecycleNode):
    """Is set up on configure, works while active, releases what it holds on cleanup.

    With the parameter `autostart` (true by default, so that `ros2 run` alone gives data)
    the node configures and activates itself, and tries again while it cannot be set up.
    Otherwise a lifecycle manager or `ros2 lifecycle set` does. A node that cannot be
    set up stays unconfigured, with the reason in the log.
    """

    def __init__(self, name: str, **options: object) -> None:
        """Create the unconfigured node; subclasses call `begin` when they are ready."""
        super().__init__(name, **options)
        self.is_open = False
        """Whether the node is set up: inactive or active."""
        self.is_active = False
        self._active_since = 0.0
        text = "Configure and activate at the start, and try again while the device is missing."
        declare(self, Declaration("autostart", True, text))
        self._starter = wall_timer(self, RETRY_PERIOD, self._start)

    @property
    def is_settled(self) -> bool:
        """Whether the node has been active long enough to have delivered something."""
        return self.is_active and time.monotonic() - self._active_since > SETTLING_TIME

    def idle_report(self, values: Mapping[str, object]) -> Report:
        """Return the status of a node that is not active, for `/diagnostics`."""
        why = "inactive" if self.is_open else self.failure or "not configured"
        return Report(Level.STALE, why, values)

    def set_up(self) -> None:
        """Get ready with the parameters in force; raises `TwbrError` if it cannot."""
        raise NotImplementedError

    def release(self) -> None:
        """Release what `set_up` took; nothing by default."""

    def begin(self) -> None:
        """Start at once if `autostart` is set."""
        if self.get_parameter("autostart").value:
            self._start()
        else:
            self._starter.cancel()

    def _start(self) -> None:
        if self.is_open or self.trigger_configure() is TransitionCallbackReturn.SUCCESS:
            self._starter.cancel()
            self.trigger_activate()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Set the node up; failure leaves it unconfigured."""
        try:
            self.set_up()
        except TwbrError as error:
            if str(error) != self.failure:  # once, not at each attempt
                self.failure = str(error)
                self.get_logger().error(self.failure)
            return TransitionCallbackReturn.FAILURE
        except Exception as error:  # a defect; rclpy would swallow it without a word
            self.failure = described(error)
            self.note_error("configure", error)
            return TransitionCallbackReturn.ERROR
        self.failure = ""
        self.is_open = True
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let data flow."""
        self.is_active, self._active_since = True, time.monotonic()
        self.get_logger().info("active")
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the flow; what was set up stays."""
        self.is_active = False
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release everything; the node can be configured again with other parameters."""
        self._release()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release everything for good."""
        self._starter.cancel()
        self._release()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Go back to unconfigured, from where the node can be started again."""
        self.get_logger().error(f"transition from {state.label} failed; unconfigured again")
        self._release()
        return TransitionCallbackReturn.SUCCESS

    def _LifecycleNodeMixin__change_state(  # noqa: N802
        self, transition: int
    ) -> TransitionCallbackReturn:
        """Make a transition; one that is not possible now is a failure and changes nothing.

        The name is that of rclpy's own method, which raises there and so ends the node.
        """
        possible = {
            number: label for number, label, *_ in self._state_machine.available_transitions
        }
        if transition not in possible:
            state = self._state_machine.current_state[1]
            wanted = ", ".join(possible.values()) or "none"
            text = f"transition {transition} is not possible while {state}; possible: {wanted}"
            self.get_logger().warning(text, throttle_duration_sec=LOG_PERIOD)
            return TransitionCallbackReturn.FAILURE
        result: TransitionCallbackReturn = super()._LifecycleNodeMixin__change_state(transition)
        return result

    def destroy_node(self) -> None:
        """Release everything with the node."""
        self._release()
        super().destroy_node()

    def _release(self) -> None:
        self.is_active = False
        if self.is_open:
            self.is_open = False
            self.release()


class DeviceNode(ManagedNode):
    """Opens its device on configure, reads it while active, closes it on cleanup."""

    def open_device(self) -> None:
        """Open the device with the parameters in force; raises `TwbrError` if it cannot."""
        raise NotImplementedError

    def close_device(self) -> None:
        """Close what `open_device` opened."""
        raise NotImplementedError

    def set_up(self) -> None:
        """Open the device."""
        self.open_device()

    def release(self) -> None:
        """Close the device."""
        self.close_device()

    def poll_timer(self, period: float, poll: Callable[[], None]) -> Timer:
        """Return the timer that reads the device once a period [s].

        It runs on the steady clock, so that a system clock that is set back does not stop it;
        under `use_sim_time` it follows the simulation.
        """
        if self.get_parameter("use_sim_time").value:
            return self.create_timer(period, poll)
        return wall_timer(self, period, poll)

    def lose_device(self, reason: str) -> None:
        """Go back to unconfigured because the device has failed; start again if allowed to."""
        self.get_logger().error(reason)
        if self.is_active:
            self.trigger_deactivate()
        self.trigger_cleanup()
        self.failure = reason
        if self.get_parameter("autostart").value:
            self._starter.reset()
