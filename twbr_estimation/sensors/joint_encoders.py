"""The encoders of a robot's joints: which there are, what counts them, how to open them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated

from ..errors import ConfigurationError, SensorError
from ..parameters.bounds import Bounds, Meaning, require_bounds
from .encoder import Counter, Encoder, EncoderSettings
from .gpio_counter import Bias, open_gpio_counter
from .motion import swing_tilt, swing_wheel
from .simulated_counter import SimulatedCounter
from .sysfs_counter import SysfsCounter


class Role(str, Enum):
    """Quantity that the encoders measure."""

    WHEELS = "wheels"
    """Wheels, on `joint_states`."""
    REFERENCE = "reference"
    """The true tilt, on `reference/joint_states` as joint `tilt`."""


class CounterSource(str, Enum):
    """Device that counts."""

    SYSFS = "sysfs"
    GPIO = "gpio"


@dataclass(frozen=True, slots=True)
class JointEncoderSettings:
    """Encoders of a robot; lists have one entry an encoder, `gpio_lines` two."""

    role: Annotated[
        Role,
        Meaning("What is measured: `wheels`, or `reference` for the joint `tilt` (one encoder)."),
    ] = Role.WHEELS
    source: Annotated[
        CounterSource, Meaning("What counts: `sysfs` (the kernel's counters) or `gpio` lines.")
    ] = CounterSource.SYSFS
    simulated: Annotated[
        bool, Meaning("Read simulated counters of a robot that swings gently, instead of a device.")
    ] = False
    joint_names: Annotated[
        tuple[str, ...],
        Meaning("Joints of the wheels, one or two; the reference is always `tilt`."),
    ] = ("left_wheel_joint", "right_wheel_joint")
    signs: Annotated[
        tuple[int, ...],
        Bounds(
            -1,
            1,
            "",
            "1, or -1 where counts fall when the wheel rolls forward or the robot leans forward.",
        ),
    ] = (1, 1)
    counters: Annotated[tuple[str, ...], Meaning("With `sysfs`: folders of the counts.")] = (
        "/sys/bus/counter/devices/counter0/count0",
        "/sys/bus/counter/devices/counter1/count0",
    )
    modulus: Annotated[
        int, Bounds(0, 2**62, "", "With sysfs: the count wraps here; 0 asks the device.")
    ] = 0
    gpio_chip: Annotated[
        str, Meaning("With `gpio`: the chip's path, name or label, as `gpiodetect` shows them.")
    ] = "/dev/gpiochip0"
    gpio_bias: Annotated[
        Bias,
        Meaning(
            "With `gpio`: the chip's own resistors: `as_is`, `pull_up`, `pull_down`, `disabled`."
        ),
    ] = Bias.AS_IS
    gpio_lines: Annotated[
        tuple[int, ...], Bounds(0, 1023, "", "With `gpio`: lines A and B of each encoder.")
    ] = (5, 6, 20, 21)
    gpio_index_lines: Annotated[
        tuple[int, ...],
        Bounds(
            -1,
            1023,
            "",
            "With `gpio` and `use_index`: the index line of each encoder; -1 for none.",
        ),
    ] = (-1, -1)
    start_angle: Annotated[
        float, Bounds(-100.0, 100.0, "rad", "Angle at the start and at each ~/set_zero.")
    ] = 0.0
    poll_rate: Annotated[float, Bounds(1.0, 2000.0, "Hz", "Rate of the messages.")] = 500.0
    encoder: Annotated[EncoderSettings, Meaning("What one count means.")] = field(
        default_factory=EncoderSettings
    )

    def __post_init__(self) -> None:
        require_bounds(self)
        if any(sign not in (1, -1) for sign in self.signs):
            raise ConfigurationError(f"signs: {self.signs} are not all 1 or -1")
        if not self.joint_names or len(self.joint_names) > 2:
            raise ConfigurationError(f"joint_names: {len(self.joint_names)} joints, not 1 or 2")
        if len(set(self.joint_names)) < len(self.joint_names) or "" in self.joint_names:
            raise ConfigurationError(
                f"joint_names: {list(self.joint_names)}; each joint needs a name of its own"
            )
        for name, each in self._lists():
            given, needed = len(getattr(self, name)), each * len(self.joints)
            if given < needed:
                raise ConfigurationError(
                    f"{name}: {given} given, {needed} needed for {', '.join(self.joints)}"
                )
            if given > 2 * each:
                raise ConfigurationError(f"{name}: {given} given, two encoders have {2 * each}")

    def _lists(self) -> tuple[tuple[str, int], ...]:
        """Return the lists in use, with their entries for one encoder."""
        if self.simulated:
            return (("signs", 1),)
        if self.source is CounterSource.SYSFS:
            return (("signs", 1), ("counters", 1))
        index = (("gpio_index_lines", 1),) if self.encoder.use_index else ()
        return (("signs", 1), ("gpio_lines", 2), *index)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints published."""
        return ("tilt",) if self.role is Role.REFERENCE else self.joint_names

    @property
    def topic(self) -> str:
        """Topic they are published on."""
        return "reference/joint_states" if self.role is Role.REFERENCE else "joint_states"


def open_encoders(
    settings: JointEncoderSettings, clock: Callable[[], int], counters: Sequence[Counter] = ()
) -> list[Encoder]:
    """Open one encoder a joint; where one fails, none stays open.

    Simulated counts rise forward, whatever `signs` says of the robot's.

    Args:
        settings: Which encoders.
        clock: Time [ns], for simulated counters.
        counters: Used instead of the devices where given.

    Raises:
        SensorError: a device is missing or cannot be read.
    """
    encoders: list[Encoder] = []
    try:
        for index in range(len(settings.joints)):
            counter = counters[index] if counters else _counter(index, settings, clock)
            sign = 1 if settings.simulated else settings.signs[index]
            encoders.append(Encoder(counter, settings.encoder, sign, _start_angle(settings, clock)))
    except OSError as error:
        raise SensorError(f"{settings.joints[len(encoders)]}: {error}") from None
    finally:
        if len(encoders) < len(settings.joints):
            for encoder in encoders:
                encoder.close()
    return encoders


def _start_angle(settings: JointEncoderSettings, clock: Callable[[], int]) -> float:
    """Return the angle at the start; a simulated reference starts at the true tilt."""
    if settings.simulated and settings.role is Role.REFERENCE:
        return settings.start_angle + swing_tilt(clock() * 1e-9)
    return settings.start_angle


def _counter(index: int, settings: JointEncoderSettings, clock: Callable[[], int]) -> Counter:
    use_index = settings.encoder.use_index
    if settings.simulated:
        angle = swing_tilt if settings.role is Role.REFERENCE else swing_wheel
        return SimulatedCounter(clock, angle, settings.encoder)
    if settings.source is CounterSource.SYSFS:
        return SysfsCounter(settings.counters[index], settings.modulus, use_index)
    line_a, line_b = settings.gpio_lines[2 * index : 2 * index + 2]
    line = settings.gpio_index_lines[index] if use_index else -1
    index_line = line if line >= 0 else None
    return open_gpio_counter(settings.gpio_chip, line_a, line_b, index_line, settings.gpio_bias)
