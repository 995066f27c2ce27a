"""A simulated robot in the place of a real one: motor commands in, its sensors out.

Time is the clock's, or in lockstep the robot's own on `/clock`: then each `control_period` waits
for its `motor/command`, so the same commands give the same run, however long they take. The
controller's `period` must be `control_period`, and all nodes but this one need `use_sim_time`.

With `sensors: registers` this process also runs mpu6050_node and encoder_node, which read simulated
chips; then the drivers publish `imu/data_raw` and `joint_states`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.node import Node
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, Float64MultiArray
from std_srvs.srv import Trigger

from ..errors import MessageError
from ..robot import Robot
from ..ros_messages import ACCEL, GYRO, IMU_DOUBLES, set_time
from ..sensors.encoder import EncoderSettings
from ..sensors.motion import Angle
from ..sensors.simulated_counter import SimulatedCounter
from ..sensors.simulated_mpu6050 import SimulatedMpu6050
from ..simulation.simulate import WHEEL_COUNTS
from ..simulation.simulated_robot import SensorReading
from ..streams.messages import ImuEncoder, JointStateEncoder, decode_float64s
from ..streams.simulator.settings import Disturbance, SensorPath, SimulatorSettings
from ..streams.simulator.simulator import Simulator
from .declarations import declarations_of, settings_from
from .diagnostics import Diagnostics, Level, Report
from .encoder_node import EncoderNode
from .guard import GuardedNode
from .mpu6050_node import Mpu6050Node
from .parameters import NodeParameters, declare_settings
from .qos import latched, listen, overridable, published
from .spin import run
from .watchdog import PERIOD, wall_timer

SETTLING = 1.0
"""In lockstep: wall time between finding the graph and the first step [s]."""

PATIENCE = 400
"""Commands of zeros after which the hand that holds the robot is explained: 2 s at 5 ms."""


class SimulatorNode(GuardedNode):
    """Feeds a `Simulator` with time and commands, and publishes what it reads."""

    def __init__(self, **options: Any) -> None:
        """Create the node; time begins at once, or in lockstep when the graph is there.

        Raises:
            ConfigurationError: a parameter that cannot be used.
        """
        super().__init__("simulator_node", **options)
        settings = declare_settings(self, SimulatorSettings())
        robot = declare_settings(self, Robot(), "robot.")
        self._disturbance = NodeParameters(
            self, declarations_of(Disturbance()), Disturbance(), settings_from
        )
        self.settings = settings
        self.simulator = Simulator(settings, robot)
        self._paused = settings.paused
        self._asked: float | None = None
        """In lockstep: when the command was asked for that is waited for, by the wall [s]."""
        self._found: float | None = None
        self._begun = False
        self._silent = 0
        self._publish_topics()
        listen(self, Float64MultiArray, "motor/command", self._on_command)
        for name in ("push", "slip", "obstacle", "stand_up", "reset", "pause", "resume"):
            self.create_service(
                Trigger, f"~/{name}", partial(self._serve, getattr(self, f"_{name}"))
            )
        self._diagnostics = Diagnostics(
            self, self.report, f"simulated robot, world {settings.world}"
        )
        if settings.lockstep:
            self._timer = wall_timer(self, PERIOD, self._watch)
        else:
            self.simulator.begin_at(self.clock_now())
            self._timer = wall_timer(self, settings.imu_period, self.follow)

    def _publish_topics(self) -> None:
        def create(kind: Any, topic: str) -> Any:
            return self.create_publisher(
                kind, topic, published(), qos_overriding_options=overridable()
            )

        settings = self.settings
        self._imu_encoder = ImuEncoder(settings.frame_id)
        self._imu_values = [0.0] * IMU_DOUBLES
        self._imu_values[4] = -1.0  # REP-145: no orientation
        self._joint_encoder = JointStateEncoder(self.simulator.joints, efforts=True)
        self._reference_encoder = JointStateEncoder([settings.reference_joint])
        self._imu = self._joints = None
        if settings.sensors is SensorPath.TOPICS:
            self._imu = create(Imu, "imu/data_raw")
            self._joints = create(JointState, "joint_states")
        self._reference = create(JointState, "reference/joint_states")
        self._time = create(ClockMessage, "/clock") if settings.lockstep else None
        self._fallen = self.create_publisher(Bool, "~/fallen", latched())
        self._fallen.publish(Bool(data=False))
        self._lay = False

    def follow(self) -> None:
        """Let the robot come up to the present."""
        if self._paused:
            self.simulator.begin_at(self.clock_now())
            return
        for reading in self.simulator.advance_to(self.clock_now()):
            self._publish(reading)

    def present(self) -> int:
        """Return the time [ns] with the robot at it, for simulated chips."""
        self.follow()
        return self.clock_now()

    def _on_command(self, data: bytes) -> None:
        if not self.settings.lockstep:
            self.follow()
        try:
            taken = self.simulator.command(decode_float64s(data))
        except MessageError as error:
            self.simulator.reject(str(error))
            taken = False
        if taken and self._asked is not None:
            self._asked = None
            self._step()

    def _step(self) -> None:
        """In lockstep: go on by one control period, and wait for the next command."""
        if self._paused:
            return
        self._asked = time.monotonic()
        periods = round(self.settings.control_period / self.settings.imu_period)
        if not self._begun:  # the reading at rest: from then on steps fall on ends of periods
            self._begun, periods = True, 0
            self._publish(self.simulator.latest)
        for reading in self.simulator.advance(periods):
            self._publish(reading)

    def _watch(self) -> None:
        """In lockstep: begin when the graph is there; go on where no command comes."""
        now = time.monotonic()
        if self._paused:
            return
        if self._found is None:
            self._found = now if self._graph_is_there() else None
        elif self._asked is None:
            if now - self._found > SETTLING:
                self._step()
        elif now - self._asked > self.settings.lockstep_timeout:
            self._silent += 1
            self.simulator.cut_motors()
            self._step()

    def _graph_is_there(self) -> bool:
        commands, sensors = map(self.resolve_topic_name, ("motor/command", "imu/data_raw"))
        return self.count_publishers(commands) > 0 and self.count_subscribers(sensors) > 0

    def _publish(self, reading: SensorReading) -> None:
        stamp = reading.stamp
        if self._time is not None:
            message = ClockMessage()
            set_time(message.clock, stamp)
            self._time.publish(message)
        self._reference.publish(
            self._reference_encoder.encode(stamp, (reading.reference,), (reading.truth.rate,))
        )
        if self._joints is not None and self._imu is not None:
            self._joints.publish(self._joint_encoder.encode(stamp, *self.simulator.wheels(reading)))
            self._imu_values[GYRO : GYRO + 3] = reading.imu[:3]
            self._imu_values[ACCEL : ACCEL + 3] = reading.imu[3:]
            self._imu.publish(self._imu_encoder.encode(stamp, self._imu_values))
        lies = self.simulator.robot.held
        if lies != self._lay:
            self._lay = lies
            self._fallen.publish(Bool(data=lies))

    def _serve(
        self, act: Callable[[], str], _: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        response.message, response.success = act(), True
        return response

    def _push(self) -> str:
        disturbance = self._disturbance.current
        self.simulator.push(disturbance)
        return f"pushed by {disturbance.push_force:g} N for {disturbance.push_duration:g} s"

    def _slip(self) -> str:
        disturbance = self._disturbance.current
        self.simulator.slip(disturbance)
        return f"slips at {disturbance.slip_speed:g} m/s for {disturbance.slip_duration:g} s"

    def _obstacle(self) -> str:
        self.simulator.robot.obstacle()
        return "an obstacle lies ahead"

    def _stand_up(self) -> str:
        self.simulator.stand_up()
        return f"stood up at {self.settings.start_tilt:g} rad"

    def _reset(self) -> str:
        self.simulator.reset()
        return "the robot begins again; stamps go on"

    def _pause(self) -> str:
        self._paused = True
        return "paused"

    def _resume(self) -> str:
        self._paused = False
        return "running"

    def report(self) -> Report:
        """Return the status for `/diagnostics`."""
        simulator = self.simulator
        values: dict[str, object] = {
            "tilt_deg": simulator.latest.truth.tilt * 57.29577951308232,
            "falls": simulator.robot.falls,
            "lockstep_timeouts": self._silent,
            **simulator.counts,
        }
        if self._paused:
            return Report(Level.OK, "paused; call ~/resume", values)
        if self.settings.lockstep and self._found is None:
            text = "waiting for who publishes motor/command and who takes imu/data_raw"
            return Report(Level.WARN, f"lockstep: {text}", values)
        if self._asked is not None and time.monotonic() - self._asked > 1.0:
            text = (
                f"lockstep: no motor/command for {time.monotonic() - self._asked:.1f} s; does the "
                f"controller run with period {self.settings.control_period:g} s?"
            )
            return Report(Level.ERROR, text, values)
        if simulator.robot.held:
            return Report(Level.WARN, "fallen; call ~/stand_up", values)
        if simulator.rejection:
            text, simulator.rejection = simulator.rejection, ""
            return Report(Level.WARN, text, values)
        if simulator.held and simulator.zeros_while_held > PATIENCE:
            text = (
                f"held: {simulator.zeros_while_held} commands, all of them zeros; a controller "
                "with a dead band needs a start_tilt beyond it, or held: false"
            )
            return Report(Level.WARN, text, values)
        if simulator.held:
            return Report(Level.OK, "held until a motor command that is not zero", values)
        if simulator.cut:
            return Report(Level.WARN, "motors cut: no motor/command", values)
        return Report(Level.OK, "running", values)


def compose(**options: Any) -> list[Node]:
    """Return the simulator, and the drivers that read its chips if there are any."""
    node = SimulatorNode(**options)
    if node.settings.sensors is SensorPath.TOPICS:
        return [node]
    imu = Mpu6050Node(chip_of(node), **options)
    return [node, imu, EncoderNode(counters_of(node), **options)]


def chip_of(node: SimulatorNode) -> SimulatedMpu6050:
    """Return the IMU's registers; reading them brings the robot up to the present."""
    return SimulatedMpu6050(node.present, node.simulator.imu_motion, noise=0.0)


def counters_of(node: SimulatorNode) -> list[SimulatedCounter]:
    """Return the counters of the left and the right wheel, 1320 counts a turn."""
    settings = EncoderSettings(WHEEL_COUNTS)
    middle = 0.5 * settings.angle_per_count  # readings are whole counts; floor must not lose one

    def angle(index: int) -> Angle:
        return lambda seconds: node.simulator.wheel_angle(index, seconds) + middle

    return [SimulatedCounter(node.present, angle(index), settings) for index in (0, 1)]


def main(arguments: list[str] | None = None) -> int:
    """Run the simulator until it is asked to stop."""
    return run(compose, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
