"""Message classes by the name of their type, for nodes that carry messages of any type."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ..errors import ConfigurationError

HEADER = "std_msgs/Header"


def message_type(name: str) -> Any:
    """Return the message class of a type such as `sensor_msgs/msg/Imu`.

    Raises:
        ConfigurationError: no name of a type, or its package is not installed.
    """
    package, _, kind = name.partition("/")
    if not (package.isidentifier() and kind.rpartition("/")[2].isidentifier()):
        raise ConfigurationError(f"message type {name!r} is not of the form package/msg/Name")
    try:
        return getattr(import_module(f"{package}.msg"), kind.rpartition("/")[2])
    except (ImportError, AttributeError):
        raise ConfigurationError(f"message type {name} is not installed") from None


def has_header(kind: Any) -> bool:
    """Return whether messages of this class begin with a header, or are one."""
    fields = kind.get_fields_and_field_types()
    first = next(iter(fields.values()), "")
    return first == HEADER or kind.__name__ == "Header"
