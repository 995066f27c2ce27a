"""The service that calibrates a robot at rest, and the file that keeps the result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from ..calibration.stillness import StillnessSettings, still_calibration
from ..configuration.files import date_of_now, read_setup, write_section
from ..errors import TwbrError
from ..robot import Calibration, Setup
from ..samples import Sample
from .declarations import Declaration, declarations_of, settings_from
from .parameters import NodeParameters, declare
from .qos import latched

CALIBRATION_FILE = Declaration(
    "calibration_file",
    "",
    "File from which the calibration is loaded at the start and to which ~/calibrate saves it.",
    read_only=True,
)


class CalibrationService:
    """`~/calibrate`, the latched `is_calibrated`, loading and saving.

    The service looks back at the readings of the last seconds, so it answers at once.
    """

    def __init__(
        self,
        node: Node,
        setup: Callable[[], Setup],
        recent: Callable[[], Sequence[Sample]],
        temperature: Callable[[], float | None],
    ) -> None:
        """Load the file where there is one, and offer the service.

        Args:
            node: The node whose parameters `calibration.*` are set.
            setup: Returns the setup in force.
            recent: Returns the latest raw samples, oldest first.
            temperature: Returns that of the IMU [degC]; None where it is not known.

        Raises:
            ConfigurationError: the file is there but cannot be used.
        """
        self._node, self._setup, self._recent = node, setup, recent
        self._temperature = temperature
        defaults = StillnessSettings()
        self._stillness = NodeParameters(
            node,
            declarations_of(defaults, "stillness."),
            defaults,
            partial(settings_from, prefix="stillness."),
        )
        name = declare(node, CALIBRATION_FILE)
        self._path = Path(name).expanduser() if name else None
        self.calibrated = self._load() or setup().calibration != Calibration()
        """Whether the calibration is more than the defaults."""
        self._publisher = node.create_publisher(Bool, "is_calibrated", latched())
        self._publisher.publish(Bool(data=self.calibrated))
        self._service = node.create_service(Trigger, "~/calibrate", self._calibrate)

    def _load(self) -> bool:
        if self._path is None or not self._path.exists():
            return False
        self._use(read_setup(self._path).calibration)
        self._node.get_logger().info(f"calibration loaded from {self._path}")
        return True

    def _use(self, calibration: Calibration) -> None:
        """Set the parameters `calibration.*`; what they are checked against applies here too."""
        declared = declarations_of(calibration, "calibration.")
        changes = [
            Parameter(each.name, Parameter.Type.DOUBLE_ARRAY, list(each.default))
            if isinstance(each.default, tuple)
            else Parameter(each.name, value=each.default)
            for each in declared
        ]
        result = self._node.set_parameters_atomically(changes)
        if not result.successful:
            raise TwbrError(result.reason)

    def _calibrate(self, request: Any, response: Any) -> Any:
        del request
        setup = self._setup()
        try:
            calibration = still_calibration(
                self._recent(), setup.calibration, setup.robot, self._stillness.current
            )
            if (temperature := self._temperature()) is not None:
                calibration = replace(calibration, gyro_bias_temperature=temperature)
            saved = self._use_and_save(calibration, setup.calibration)
        except (TwbrError, OSError) as error:
            response.success, response.message = False, str(error)
            self._node.get_logger().warning(f"not calibrated: {error}")
            return response
        self.calibrated = True
        self._publisher.publish(Bool(data=True))
        bias = ", ".join(f"{value:.6f}" for value in calibration.gyro_bias)
        response.success, response.message = True, f"gyro bias {bias} rad/s; {saved}"
        self._node.get_logger().info(response.message)
        return response

    def _use_and_save(self, calibration: Calibration, former: Calibration) -> str:
        """Use and keep a calibration; where it cannot be kept, the former one stays in force.

        No sample is corrected in between: this is one callback of the node's executor.
        """
        self._use(calibration)
        try:
            return self._save(calibration)
        except (TwbrError, OSError):
            self._use(former)
            raise

    def _save(self, calibration: Calibration) -> str:
        if self._path is None:
            return f"not saved: the parameter {CALIBRATION_FILE.name} is empty"
        provenance: dict[str, str | float] = {
            "source": f"service {self._service.srv_name} of a robot at rest",
            "date": date_of_now(),
            "duration": self._stillness.current.duration,
        }
        write_section(self._path, calibration, provenance, replace=True)
        return f"saved to {self._path}"
