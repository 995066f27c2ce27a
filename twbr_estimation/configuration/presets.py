"""Settings that ship with the package: a folder a preset, a file a sampling period."""

from __future__ import annotations

import math
from pathlib import Path

from ..errors import ConfigurationError
from ..parameters.argument_checks import shown
from ..robot import CorrectionSettings
from .files import read_correction, read_settings
from .filter_settings import Settings

_FOLDER = Path(__file__).parent.parent / "presets"


def presets() -> tuple[str, ...]:
    """Return the names of the presets."""
    return tuple(sorted({path.parent.name for path in _FOLDER.glob("*/*.yaml")}))


def preset(name: str, dt: float) -> tuple[CorrectionSettings | None, Settings]:
    """Return the settings whose sampling period is nearest to `dt` [s], by ratio.

    The settings include their sampling period: `Settings.warnings(dt)` reports a difference.

    Raises:
        ConfigurationError: no such preset, or `dt` is not above 0.
    """
    if not isinstance(name, str) or name not in presets():
        raise ConfigurationError(
            f"`preset`: there is no preset {shown(name)}; there are: {', '.join(presets())}"
        )
    if not dt > 0.0:
        raise ConfigurationError(f"preset {name}: sampling period {dt} s is not above 0")
    rows = {path: read_settings(path) for path in sorted(_FOLDER.glob(f"{name}/*.yaml"))}
    nearest = min(rows, key=lambda path: abs(math.log(rows[path].dt / dt)))
    return read_correction(nearest), rows[nearest]
