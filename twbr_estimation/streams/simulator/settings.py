"""Parameters of simulator_node, with their meaning."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated

from ...errors import ConfigurationError
from ...parameters.bounds import Bounds, Meaning, require_bounds


class CommandUnit(str, Enum):
    """Quantity of the numbers of a motor command."""

    VOLTAGE = "voltage"
    """[V]."""
    TORQUE = "torque"
    """Of a wheel [N m]."""


class SensorPath(str, Enum):
    """Way in which the sensors are read."""

    TOPICS = "topics"
    """Their messages are published."""
    REGISTERS = "registers"
    """By the drivers, from simulated chips."""


class Physics(str, Enum):
    """Model that moves the robot."""

    RIG = "rig"
    """The project's own rig."""
    MUJOCO = "mujoco"
    """The physics engine MuJoCo, extra `physics`."""


@dataclass(frozen=True, slots=True)
class SimulatorSettings:
    """Settings of the simulation; fixed at the start.

    Raises:
        ConfigurationError: a number out of bounds, or choices that exclude each other.
    """

    world: Annotated[
        str, Meaning("What is wrong with robot, sensors and ground: a world of `twbr simulate`.")
    ] = "paper"
    physics: Annotated[
        Physics,
        Meaning(
            "What moves the robot: `rig`, or the physics engine `mujoco`, in which `scene` stands "
            "for the world's ground and disturbances, and there are two encoders."
        ),
    ] = Physics.RIG
    scene: Annotated[
        str, Meaning("With `mujoco`: what happens to the robot, a scene of `twbr simulate`.")
    ] = "stand"
    seed: Annotated[int, Bounds(0, 2**31 - 1, "", "Number of the random draw")] = 1
    disturbed: Annotated[
        bool,
        Meaning(
            "Whether the world's pushes, obstacles, slips, slopes and turns come by themselves."
        ),
    ] = False
    duration: Annotated[
        float, Bounds(1.0, 3600.0, "s", "Disturbances and noise are drawn for; then they repeat")
    ] = 60.0
    imu_period: Annotated[
        float, Bounds(0.0005, 0.1, "s", "Of imu/data_raw and the joints, a multiple of 0.0005")
    ] = 0.0025
    control_period: Annotated[
        float,
        Bounds(0.0005, 0.1, "s", "In lockstep: a command is waited for after each, a multiple of "
               "imu_period and the `period` of the controller"),
    ] = 0.005  # fmt: skip
    lockstep: Annotated[
        bool,
        Meaning(
            "Whether simulated time, on `/clock`, waits for the commands; otherwise it is "
            "the clock's."
        ),
    ] = False
    lockstep_timeout: Annotated[
        float,
        Bounds(0.1, 3600.0, "s", "In lockstep: wall time after which a step is taken without its "
               "command, motors cut"),
    ] = 5.0  # fmt: skip
    paused: Annotated[bool, Meaning("Whether time stands still until `~/resume`.")] = False
    sensors: Annotated[
        SensorPath,
        Meaning(
            "`topics` publishes the sensors' messages; `registers` lets mpu6050_node and "
            "encoder_node, in this process, read simulated chips. Not in lockstep: a chip "
            "has a separate clock."
        ),
    ] = SensorPath.TOPICS
    command_unit: Annotated[
        CommandUnit,
        Meaning("Unit of `motor/command`: `voltage` of a motor [V], or `torque` of a wheel [N m]."),
    ] = CommandUnit.VOLTAGE
    command_timeout: Annotated[
        float, Bounds(0.01, 10.0, "s", "Without a command for this long the motors are cut")
    ] = 0.1
    wheel_joints: Annotated[
        tuple[str, ...],
        Meaning(
            "Names of one or two wheel joints; two share the encoder of a world that has "
            "one. Empty for `wheel_joint`, or left_wheel_joint and right_wheel_joint in a "
            "world with two encoders."
        ),
    ] = ()
    reference_joint: Annotated[str, Meaning("Name of the joint in `reference/joint_states`.")] = (
        "tilt"
    )
    frame_id: Annotated[str, Meaning("Frame of `imu/data_raw`.")] = "imu_link"
    start_tilt: Annotated[
        float, Bounds(-0.6, 0.6, "rad", "Tilt at the start and after ~/stand_up and ~/reset")
    ] = 0.0
    held: Annotated[
        bool,
        Meaning(
            "Whether a hand holds the robot, at the start and after ~/stand_up and ~/reset, "
            "until the first motor command that is not zero."
        ),
    ] = True
    stay_down: Annotated[
        bool,
        Meaning(
            "Whether a fallen robot stays down until `~/stand_up`; otherwise it is lifted at once."
        ),
    ] = True
    compiled: Annotated[
        bool, Meaning("Whether the plant is compiled: cheaper, after some seconds at the start.")
    ] = False

    def __post_init__(self) -> None:
        require_bounds(self)
        if len(self.wheel_joints) > 2:
            raise ConfigurationError(f"wheel_joints: {len(self.wheel_joints)} joints, not 1 or 2")
        if self.lockstep and self.sensors is SensorPath.REGISTERS:
            raise ConfigurationError("sensors: registers cannot be read in lockstep")
        samples = self.control_period / self.imu_period
        if self.lockstep and abs(samples - round(samples)) > 1e-6:
            raise ConfigurationError(
                f"control_period: {self.control_period:g} s is not a multiple of imu_period, "
                f"{self.imu_period:g} s"
            )


@dataclass(frozen=True, slots=True)
class Disturbance:
    """Strengths of the disturbances on demand.

    Raises:
        ConfigurationError: a number out of bounds.
    """

    push_force: Annotated[
        float, Bounds(-100.0, 100.0, "N", "Of ~/push, a half sine on the body; forward")
    ] = 3.0
    push_duration: Annotated[float, Bounds(0.001, 5.0, "s", "Of ~/push")] = 0.2
    slip_speed: Annotated[
        float, Bounds(-3.0, 3.0, "m/s", "Of ~/slip, a half sine of the treads over the ground")
    ] = 0.3
    slip_duration: Annotated[float, Bounds(0.001, 5.0, "s", "Of ~/slip")] = 0.1

    def __post_init__(self) -> None:
        require_bounds(self)
