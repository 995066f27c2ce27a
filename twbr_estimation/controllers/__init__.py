"""Balance controllers, one a file; see `base` for what a controller is."""

from .base import (
    ControlInput,
    Controller,
    MotorVoltages,
    controller_named,
    controllers,
    listed_controllers,
)

__all__ = [
    "ControlInput",
    "Controller",
    "MotorVoltages",
    "controller_named",
    "controllers",
    "listed_controllers",
]
