"""Motor control on top of `balance`: permission to start, time of the next step, no jumps.

| what happens | outcome |
|---|---|
| the start, and a stream that starts afresh | cut until the robot is stood up |
| a fall, or voltages that are no numbers | cut until it is stood up; without `start_when_upright` until it is enabled |
| tilt or wheels late, the tilt not valid, frozen, or stamped in the past or by another clock | cut until that is over; after more than `RESUMED` until it is stood up |
| stamps that jump ahead | cut until it is stood up |
| another controller, or other parameters | goes on from the last voltages, over `blend_time` |
| disabled | cut until it is enabled |
"""  # noqa: E501

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import Annotated

from ...controllers.base import MotorVoltages
from ...parameters.bounds import Bounds, Meaning, require_bounds
from ...pipeline.pairing import WheelReading
from ...pipeline.physical import BEYOND, FASTEST, NOT_FINITE
from ...plants.laddach2022 import PlantState, motor_torque
from ...samples import RESTART_GAP
from ..stamps import StampGuard, Verdict
from .balance import NO_VOLTAGE, BalanceConfiguration, BalanceStream, Standing
from .freshness import FrozenTilt, judged_by_stamp

EARLY = 0.1
"""Share of a period by which a step may come early, for samples that jitter."""
LARGEST_TILT = 10.0
"""Largest believable tilt [rad]; a controller's source may count beyond a turn."""
RESUMED = 0.1
"""After a longer interruption [s] the robot must be stood up before the motors run again."""
UNINTERRUPTED = {Standing.BALANCING, Standing.WAITING, Standing.FALLEN}
DISABLED = "disabled; call ~/enable"


@dataclass(frozen=True, slots=True)
class ControlSettings:
    """User settings beyond `BalanceSettings`.

    Raises:
        ConfigurationError: a number out of bounds.
    """

    start_when_upright: Annotated[
        bool,
        Meaning(
            "Balance as soon as the robot is stood up; otherwise only after `~/enable`, "
            "also after each fall."
        ),
    ] = True
    blend_time: Annotated[
        float, Bounds(0.0, 10.0, "s", "Over which a change of controller or parameters acts")
    ] = 0.2
    rate_time_constant: Annotated[
        float, Bounds(0.0, 1.0, "s", "Low-pass of the rate where it is derived from the tilt")
    ] = 0.01
    expect_change: Annotated[
        bool,
        Meaning(
            "Whether a tilt and rate that stay the same to the last digit for "
            "`tilt_timeout`, while the motors run, count as frozen and cut them. False for "
            "an estimator that rounds."
        ),
    ] = True
    clock_timeout: Annotated[
        float,
        Bounds(0.0, 3600.0, "s", "Under use_sim_time: real time without a tilt after which the "
               "motors are cut; 0 is `tilt_timeout`. Longer for a simulation that is slower than "
               "real time or in lockstep"),
    ] = 0.0  # fmt: skip

    def __post_init__(self) -> None:
        require_bounds(self)


@dataclass(frozen=True, slots=True)
class ControlConfiguration:
    """Everything a stream is made of."""

    control: ControlSettings = field(default_factory=ControlSettings)
    balance: BalanceConfiguration = field(default_factory=BalanceConfiguration)


class ControlStream:
    """Tilts in, voltages out where a step is due."""

    def __init__(self, configuration: ControlConfiguration) -> None:
        """Begin with the motors cut.

        Raises:
            ConfigurationError: an unknown parameter, or a value out of bounds.
        """
        self.guard = StampGuard()
        self.counts: Counter[str] = Counter(steps=0, falls=0, cuts=0)
        """Numbers of events."""
        self._configuration = configuration
        self._balance = BalanceStream(configuration.balance)
        self._balance.lay_down()
        self._enabled = configuration.control.start_when_upright
        self._tilt: tuple[int, float, float] | None = None
        self._due: int | None = None
        self._frozen = FrozenTilt()
        self._first = Standing.FALLEN
        self._interrupted: int | None = None
        self._last_step = 0
        self._given = NO_VOLTAGE
        self._offset, self._blend_left = (0.0, 0.0), 0.0
        self._changed = False

    @property
    def cut_because(self) -> str:
        """Why the motors are cut; empty while the robot balances."""
        standing = self._balance.standing
        if not self._enabled:
            return DISABLED
        return "" if standing is Standing.BALANCING else standing.value

    @property
    def fell_because(self) -> str:
        """Why the motors of a robot that has fallen since were cut first; empty if it just fell."""
        fallen = self._enabled and self._balance.standing is Standing.FALLEN
        return self._first.value if fallen and self._first is not Standing.FALLEN else ""

    @property
    def enabled(self) -> bool:
        """Whether it may balance once the robot is stood up."""
        return self._enabled

    @property
    def balance(self) -> BalanceStream:
        """Input of the controller."""
        return self._balance

    @property
    def last_tilt(self) -> int | None:
        """Stamp of the latest tilt [ns]."""
        return None if self._tilt is None else self._tilt[0]

    def configure(self, configuration: ControlConfiguration) -> None:
        """Go over to another configuration without a jump of the voltages.

        Raises:
            ConfigurationError: an unknown parameter, or a value out of bounds; nothing changed.
        """
        self._balance.configure(configuration.balance)
        self._configuration, self._changed = configuration, True

    def enable(self) -> str:
        """Let the robot balance from now on; return a message."""
        self._enabled = True
        limit = self._balance.settings.fall_tilt
        if self._tilt is not None and abs(self._tilt[1]) < limit:
            self._balance.stand_up()
            return "enabled"
        return "enabled; it balances as soon as it is stood up"

    def disable(self) -> str:
        """Cut the motors from now on; return a message."""
        self._enabled = False
        return "disabled: the motors are cut"

    def set_valid(self, valid: bool) -> None:
        """Take whether the tilt can be used, from `tilt/valid`."""
        self._balance.set_valid(valid)

    def add_wheels(self, reading: WheelReading) -> None:
        """Take a reading of the wheel encoders."""
        self._balance.add_wheels(reading)

    def command(self, now: int, velocity: float, yaw_rate: float) -> None:
        """Take a commanded speed [m/s] and yaw rate [rad/s] given at `now` [ns]."""
        self._balance.command(now, velocity, yaw_rate)

    def add_tilt(
        self, stamp: int, tilt: float, rate: float | None = None, now: int | None = None
    ) -> MotorVoltages | None:
        """Take a tilt; return the motors' voltages where a step is due.

        Args:
            stamp: Of the sample, or of the arrival where it has none [ns].
            tilt: From the balance point [rad], positive forward.
            rate: Its rate [rad/s]; None to derive it.
            now: Time of the stamps' clock [ns], to judge whether the tilt is one of
                now; None where that is not in question.
        """
        if not (abs(tilt) <= LARGEST_TILT and abs(rate or 0.0) <= FASTEST):
            finite = math.isfinite(tilt) and math.isfinite(rate or 0.0)
            self.guard.skip(BEYOND if finite else NOT_FINITE)
            return None
        verdict = self.guard.check(stamp)
        if verdict is Verdict.SKIP:
            return None
        if verdict is Verdict.RESTART:
            self._balance.reset()
            self._balance.lay_down()
            self._tilt = self._due = None
        fault = None if now is None else self._judged(stamp, (tilt, rate), now)
        self._balance.set_fault(fault)
        rate = self._derived_rate(stamp, tilt) if rate is None else rate
        self._tilt = (stamp, tilt, rate)
        self._balance.add_tilt(stamp, tilt, rate)
        early = round(EARLY * self._balance.settings.period * 1e9)
        if self._due is not None and stamp < self._due - early and fault is None:
            return None
        return self._step(stamp)

    def _judged(self, stamp: int, value: tuple[float, float | None], now: int) -> Standing | None:
        """Return why a tilt is not one of now; None where it is. A jump ahead lays down."""
        limit = self._balance.settings.tilt_timeout
        # No `tick` has noted the pause where the process was stopped or stuck meanwhile.
        pause = min(limit + RESUMED, RESTART_GAP)
        if self._tilt is not None and (stamp - self._tilt[0]) * 1e-9 > pause:
            self._balance.lay_down()
        if fault := judged_by_stamp(stamp, now, limit):
            return fault
        frozen = self._frozen.add(stamp, value, self._given != NO_VOLTAGE, limit)
        expected = self._configuration.control.expect_change
        return Standing.FROZEN if frozen and expected else None

    def torques(self, voltages: MotorVoltages) -> tuple[float, float]:
        """Return the torques on the left and the right wheel [N m] under these voltages now."""
        odometry, robot = self._balance.odometry, self._configuration.balance.robot
        if odometry is None or self._tilt is None or voltages == NO_VOLTAGE:
            return 0.0, 0.0
        plant, apart = robot.plant(), 0.5 * robot.track_width * odometry.yaw_rate
        left, right = (
            0.5 * motor_torque(PlantState(0.0, speed, 0.0, self._tilt[2]), voltage, plant)
            for voltage, speed in zip(
                voltages, (odometry.velocity - apart, odometry.velocity + apart), strict=True
            )
        )
        return left, right

    def tick(self, now: int) -> MotorVoltages | None:
        """Return the cut where the tilt has fallen silent by `now` [ns]; else nothing."""
        late = self._balance.settings.tilt_timeout
        if self._tilt is None or (now - self._tilt[0]) * 1e-9 <= late:
            return None
        cut = self._step(now, silent_since=self._tilt[0] + round(late * 1e9))
        self._due = None  # the next tilt is a step, however it is stamped
        return cut

    def _derived_rate(self, stamp: int, tilt: float) -> float:
        if self._tilt is None:
            return 0.0
        last, before, rate = self._tilt
        dt = (stamp - last) * 1e-9
        if dt > RESTART_GAP:
            return 0.0
        share = dt / (self._configuration.control.rate_time_constant + dt)
        return rate + share * ((tilt - before) / dt - rate)

    def _step(self, now: int, silent_since: int | None = None) -> MotorVoltages:
        dt = (now - self._last_step) * 1e-9
        self._schedule(now)
        balanced = not self.cut_because
        if not self._enabled:
            self._balance.lay_down()
        asked = self._balance.step(now)
        self.counts["steps"] += 1
        self._note_interruption(now, now if silent_since is None else silent_since)
        if balanced and self._balance.standing is Standing.FALLEN:
            self._fell("falls")
        if not math.isfinite(asked.left + asked.right):
            self._balance.lay_down()
            self._fell("not_finite_voltages")
            asked = NO_VOLTAGE
        if self.cut_because:
            self.counts["cuts"] += balanced
            self._first = self._balance.standing if balanced else self._first
            self._given, self._blend_left, self._changed = NO_VOLTAGE, 0.0, False
        else:
            self._given, self._first = self._blended(asked, dt), Standing.FALLEN
        return self._given

    def _note_interruption(self, now: int, since: int) -> None:
        """After a long interruption let the robot be stood up before the motors run again."""
        if self._balance.standing in UNINTERRUPTED:
            self._interrupted = None
            return
        if self._interrupted is None:
            self._interrupted = since
        if (now - self._interrupted) * 1e-9 > RESUMED:
            self._balance.lay_down()

    def _fell(self, how: str) -> None:
        self.counts[how] += 1
        self._enabled = self._enabled and self._configuration.control.start_when_upright

    def _schedule(self, now: int) -> None:
        """Note the step, and when the next one is due: on average after each period."""
        period = round(self._balance.settings.period * 1e9)
        regular = self._due is not None and now < self._due + period
        self._due = (self._due if regular and self._due is not None else now) + period
        self._last_step = now

    def _blended(self, asked: MotorVoltages, dt: float) -> MotorVoltages:
        """Return the voltages, a difference to those before a change let out over a while."""
        whole = self._configuration.control.blend_time
        if self._changed:
            self._changed, self._blend_left = False, whole
            self._offset = (self._given.left - asked.left, self._given.right - asked.right)
        elif self._blend_left > 0.0:
            self._blend_left = max(self._blend_left - dt, 0.0)
        if self._blend_left == 0.0:
            return asked
        share, limit = self._blend_left / whole, self._configuration.balance.robot.supply_voltage
        left, right = (
            min(max(voltage + share * offset, -limit), limit)
            for voltage, offset in zip(asked, self._offset, strict=True)
        )
        return MotorVoltages(left, right)
