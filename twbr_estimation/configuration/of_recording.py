"""Robot, calibration, correction and filter settings that apply to one recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..disk.reading import is_folder
from ..errors import ConfigurationError
from ..robot import Setup
from .files import read_settings, read_setup
from .filter_settings import Settings
from .presets import preset

CONFIG_FOLDER = "config"
"""Folder inside a recording that describes its robot."""
TERMS = ("euler", "centrifugal", "wheel", "yaw")
"""Motion terms of the correction that can be switched off."""


def configuration(
    path: Path, dt: float, config: Path | None = None, preset_name: str | None = None
) -> tuple[Setup, Settings]:
    """Return robot, calibration, correction and filter settings for a recording.

    Args:
        path: the recording; its own `config` folder is used where `config` is None.
        dt: its sampling period [s], by which a preset chooses its row.
        config: folder with configuration files.
        preset_name: rules over the filter and correction settings of the files.

    Raises:
        ConfigurationError: unreadable or wrong files, or an unknown preset.
    """
    folder = config or path / CONFIG_FOLDER
    if config is not None and not is_folder(config):
        raise ConfigurationError(f"{config}: there is no such configuration folder")
    if not is_folder(folder):
        setup, settings = Setup(), Settings()
    else:
        setup, settings = read_setup(folder), read_settings(folder)
    if preset_name is None:
        return setup, settings
    correction, settings = preset(preset_name, dt)
    if correction is None:
        return setup, settings
    kept = {name: getattr(setup.correction, name) for name in TERMS}
    return replace(setup, correction=replace(correction, **kept)), settings


def with_terms(setup: Setup, terms: Sequence[str]) -> Setup:
    """Return `setup` with exactly these motion terms switched on."""
    switches = {name: name in terms for name in TERMS}
    return replace(setup, correction=replace(setup.correction, **switches))
