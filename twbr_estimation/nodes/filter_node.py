"""`imu/data_corrected`, or `imu/data_raw` straight in, to the tilt.

The filter, its parameters and the filters beside it change between two samples. Where `imu/valid`
is false, `tilt/valid` is false, too. `tilt_deg` is `tilt` in degrees, for plots; it is published
only while a node subscribes to it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Any

from sensor_msgs.msg import Imu, Temperature
from std_msgs.msg import Bool, Float64MultiArray
from std_srvs.srv import Trigger

from ..checks.finding import Finding, Severity, sentences
from ..live_code.providing import BackgroundSteps
from ..printing.text import counted
from ..samples import CorrectedSample, TiltEstimate
from ..streams.filtering import FilterStream
from ..streams.guarded import came_instead
from ..streams.inputs import InputSettings
from ..streams.messages import decode_motor_command
from ..streams.stamps import StampAge
from ..streams.tilt_input import TiltInput
from .diagnostics import Diagnostics, Level, Report
from .filter_parameters import FilterNodeConfiguration, declare_filter_parameters
from .guard import GuardedNode
from .inputs import IMU_FRAME, MachineCode, listen_to_wheels
from .parameters import declare, declare_settings
from .qos import latched, listen
from .robot_agreement import RobotAgreement
from .spin import run
from .tilt_outputs import TiltOutputs
from .tilt_transform import TiltTransform
from .watchdog import Watchdog

ARITHMETIC = (ArithmeticError, ValueError)
"""What a filter's step raises where its numbers fit no equation."""


class FilterNode(GuardedNode):
    """Subscribes, filters, publishes; the work is done by a `FilterStream`."""

    def __init__(self, subscribe: bool = True, **options: Any) -> None:
        """Create the node.

        Args:
            subscribe: False where a correction in the same process calls `take`.
            options: Options of `rclpy.node.Node`.
        """
        super().__init__("filter_node", **options)
        self._chosen = declare_filter_parameters(self, self._configure)
        configuration = self._chosen.current
        inputs = declare_settings(self, InputSettings())
        self._stream = FilterStream(configuration.filters)
        self._inputs = inputs
        self._input = TiltInput(inputs, configuration.setup)
        self._outputs = TiltOutputs(self, declare(self, IMU_FRAME))
        self._transform = TiltTransform(self)
        self._age = StampAge()
        self._counts = {"samples": 0, "not_finite_estimates": 0, "failed_steps": 0}
        self._trusted, self._lost = False, 0
        self._subscribes, self._joints, self._motors = subscribe, None, None
        self._judge = ""
        """Topic with the judgement of who corrects the samples; empty in the same process."""
        self._temperature: Any = None
        self.pass_motors = self._input.add_motors
        """Who gets the motor commands; a correction in the same process where there is one."""
        self.pass_estimate: Callable[[int, TiltEstimate, float], None] | None = None
        """Called with stamp [ns], estimate and published tilt, for a controller in this process."""
        self.pass_valid: Callable[[bool], None] | None = None
        """Called with what is published on `tilt/valid`."""
        if subscribe:
            listen(self, Imu, "imu/data_corrected", self._on_imu)
            valid = self.create_subscription(Bool, "imu/valid", self._on_valid, latched())
            self._judge = valid.topic_name
        self._find_inputs()
        self.create_service(Trigger, "~/reset", self._on_reset)
        self._watchdog = Watchdog(self, inputs.timeout, self._tick)
        self._agreement = RobotAgreement(self, lambda: self._chosen.current.setup.robot)
        self._diagnostics = Diagnostics(self, self._report)
        self._code = MachineCode(self, self._use_machine_code)  # last: a thread that begins to load

    def _find_inputs(self) -> None:
        """Listen to wheels and motors from the moment on when something needs them."""
        self._input.paired = self._stream.uses_wheels or self._stream.uses_motors
        if self._subscribes and self._joints is None and self._input.needs_wheels:
            self._joints = listen_to_wheels(self, self._inputs, self._on_joints)
        if self._subscribes and self._temperature is None and self._input.raw:
            self._temperature = listen(self, Temperature, "imu/temperature", self._on_temperature)
        if self._motors is None and self._stream.uses_motors:
            self._motors = listen(self, Float64MultiArray, "motor/command", self._on_motors)

    def _use_machine_code(self, steps: BackgroundSteps) -> None:
        self._stream.use(steps.of_filter)
        self._input.use(steps.correction())

    def _configure(self, configuration: FilterNodeConfiguration) -> None:
        self._stream.configure(configuration.filters)
        self._input.configure(configuration.setup)
        self._find_inputs()

    def _on_imu(self, data: bytes) -> None:
        was_raw = self._input.raw
        ready = self._input.add_imu(data, self.clock_now())
        if self._input.raw and not was_raw:
            why = "have a default" if self._input.default_orientation else "report no"
            self.get_logger().info(f"the Imu messages {why} orientation: correcting them here")
            self._find_inputs()
        for stamp, sample in ready:
            self.take(stamp, sample)

    def _on_valid(self, message: Bool) -> None:
        self._stream.input_valid = message.data
        if not message.data:
            self._trusted = False
            self._say_valid(False, always=False)

    def _on_joints(self, data: bytes) -> None:
        for stamp, sample in self._input.add_wheels(data, self.clock_now()):
            self.take(stamp, sample)

    def _on_temperature(self, data: bytes) -> None:
        self._input.add_temperature(data)

    def _on_motors(self, data: bytes) -> None:
        self.pass_motors(decode_motor_command(self.clock_now(), data))

    def begin_checks(self) -> None:
        """Forget what was found to be wrong with the sensors, because their setup has changed."""
        self._stream.checks.restart()

    def take(self, stamp: int, sample: CorrectedSample) -> None:
        """Filter and publish one corrected sample of this stamp [ns]."""
        self._watchdog.feed()
        self._filter(stamp, sample)
        self._say_valid(self._trusted, always=False)

    def _say_valid(self, valid: bool, always: bool = True) -> None:
        self._outputs.publish_valid(valid, always)
        if self.pass_valid is not None:
            self.pass_valid(valid)

    def _filter(self, stamp: int, sample: CorrectedSample) -> None:
        stream, outputs = self._stream, self._outputs
        self._counts["samples"] += 1
        self._trusted = False  # until the step is done, whatever ends it
        try:
            estimate = stream.step(sample)
        except ARITHMETIC as error:
            self._lose("failed_steps", error)
            return
        if not math.isfinite(estimate.tilt + estimate.rate + estimate.tilt_variance):
            self._lose("not_finite_estimates")
            return
        tilt = stream.published_tilt(estimate, self._age_of(stamp))
        outputs.publish(stamp, sample, estimate, tilt, stream.variance(estimate))
        self._trusted = stream.trusted
        if self.pass_estimate is not None:  # the judgement first: the controller acts at once
            self._say_valid(self._trusted, always=False)
            self.pass_estimate(stamp, estimate, tilt)
        outputs.publish_comparison(stamp, stream.compare(sample))
        self._transform.publish(stamp, estimate.tilt)

    def _lose(self, count: str, error: Exception | None = None) -> None:
        """Start the filters afresh, because the active one has no estimate."""
        self._counts[count] += 1
        self._stream.reset()
        if error is not None:
            self.note_error("filter", error)

    def _age_of(self, stamp: int) -> float:
        """Return the age of a sample [s] where the tilt is predicted."""
        if not self._stream.settings.predict:
            return 0.0
        return self._age.note(stamp, self.clock_now())

    def _on_reset(self, request: Any, response: Any) -> Any:
        del request
        self._stream.reset()
        response.success, response.message = True, "the filters start afresh at the next sample"
        return response

    def _tick(self) -> None:
        self._code.look()
        fresh = self._watchdog.fresh
        if not fresh:
            for stamp, sample in self._input.flush():
                self._filter(stamp, sample)
        if not self._stream.input_valid and not self.count_publishers(self._judge):
            self._stream.input_valid = True  # who found the samples wrong is gone
        self._say_valid(fresh and self._trusted)
        self._outputs.find_plotters()

    def _report(self) -> Report:
        kind = "raw" if self._input.raw else "corrected"
        chosen = {"filter": self._stream.settings.filter, "input": kind}
        period = self._stream.period()
        counts = self._stream.counts()
        newly_lost, self._lost = counts["lost_samples"] - self._lost, counts["lost_samples"]
        values = {
            **chosen,
            "period_s": period,
            **self._counts,
            "unreadable_messages": self.unreadable,
            **counts,
            **self._input.counts(),
            "machine_code": self._code.shown,
        }
        values["wheels_ignored_s"] = round(self._stream.wheels_ignored(), 1)
        if not self._watchdog.started:
            return Report(Level.WARN, self._waiting(), values)
        if not self._watchdog.fresh:
            age = self._watchdog.age
            return Report(Level.ERROR, f"stale: no usable sample for {age:.1f} s", values)
        if wrong := self._stream.contradictions():
            return Report(Level.ERROR, wrong, values)
        if not self._trusted:
            lost = f"; {counted(newly_lost, 'sample')} lost or late" if newly_lost else ""
            causes = sentences(each for each in self._doubts() if each.severity is Severity.FAIL)
            why = [causes, self._stream.distrust(), *self._stream.remarks()]
            return Report(Level.WARN, "; ".join(filter(None, why)) + lost, values)
        warnings = [
            f"{counted(newly_lost, 'sample')} lost or late" if newly_lost else "",
            *self._stream.remarks(),
            *self._stream.warnings(period),
            sentences(self._doubts()),
            self._agreement.problem(time.monotonic()),
            self._transform.problem,
            self._other_clock(),
            *self._input.problems(),
        ]
        if any(warnings):
            return Report(Level.WARN, "; ".join(each for each in warnings if each), values)
        return Report(Level.OK, "estimating", values)

    def _doubts(self) -> Sequence[Finding]:
        """Return what the checks found; where both see it, the longer look has the better words."""
        longer = self._input.checks.look(time.monotonic()) if self._input.raw else ()
        known = {each.subject for each in longer}
        return [
            *longer,
            *(each for each in self._stream.checks.doubts if each.subject not in known),
        ]

    def _waiting(self) -> str:
        """Return what is waited for, and what came instead."""
        skipped = {**self._input.counts(), "unreadable": self.unreadable}
        waiting = ("waiting for imu/data_corrected", *self._input.problems())
        return came_instead("; ".join(waiting), skipped)

    def _other_clock(self) -> str:
        """Return that nothing is predicted because stamps and clock do not belong together."""
        if not self._stream.settings.predict or self._age.known:
            return ""
        return (
            f"the stamps are {self._age.age:.6g} s behind this node's clock, that of another one: "
            "nothing is predicted"
        )


def main(arguments: list[str] | None = None) -> int:
    """Run the node until it is asked to stop."""
    return run(FilterNode, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
