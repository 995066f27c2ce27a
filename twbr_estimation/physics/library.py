"""The physics engine, imported where it is first needed."""

from __future__ import annotations

from typing import Any

from ..errors import ConfigurationError


def mujoco() -> Any:
    """Return the module `mujoco`.

    Raises:
        ConfigurationError: it is not installed.
    """
    try:
        import mujoco as library
    except ImportError:
        raise ConfigurationError(
            "physics mujoco needs MuJoCo: pip install 'twbr_estimation[physics]'"
        ) from None
    return library
