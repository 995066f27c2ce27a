"""Robot, calibration, correction and filter settings that apply to one recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..disk.reading import is_folder
from ..errors import ConfigurationError
from ..parameters.argument_checks import shown
from ..robot import Setup
from .files import FILES, read_settings, read_setup
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
        config: folder with configuration files; those it lacks come from the recording.
        preset_name: rules over the filter and correction settings of the files.

    Raises:
        ConfigurationError: unreadable or wrong files, or an unknown preset.
    """
    files = configuration_files(path, config)
    if files:
        setup, settings = read_setup(*files), read_settings(*files)
    else:
        setup, settings = Setup(), Settings()
    if preset_name is None:
        return setup, settings
    correction, settings = preset(preset_name, dt)
    if correction is None:
        return setup, settings
    kept = {name: getattr(setup.correction, name) for name in TERMS}
    return replace(setup, correction=replace(correction, **kept)), settings


def configuration_files(path: Path, config: Path | None = None) -> tuple[Path, ...]:
    """Return the files that configure a recording: those of `config`, else the recording's own.

    Raises:
        ConfigurationError: `config` is no folder, or holds none of the files.
    """
    if config is not None:
        if not is_folder(config):
            raise ConfigurationError(f"{config}: there is no such configuration folder")
        if not any((config / name).is_file() for name in FILES):
            raise ConfigurationError(f"{config}: holds none of {', '.join(FILES)}")
    folders = [folder for folder in (config, path / CONFIG_FOLDER) if folder is not None]
    found = (
        next((folder / name for folder in folders if (folder / name).is_file()), None)
        for name in FILES
    )
    return tuple(file for file in found if file is not None)


def origin_of(path: Path, config: Path | None = None) -> str:
    """Return where each file comes from, in words, where they come from two folders; else ''."""
    by_folder: dict[Path, list[str]] = {}
    for file in configuration_files(path, config):
        by_folder.setdefault(file.parent, []).append(file.name)
    if len(by_folder) < 2:
        return ""
    return "; ".join(f"{', '.join(names)} from {folder}" for folder, names in by_folder.items())


def require_terms(terms: Sequence[str]) -> tuple[str, ...]:
    """Return the names of motion terms as a tuple.

    Raises:
        ConfigurationError: there is no such term.
    """
    for name in terms:
        if not isinstance(name, str) or name not in TERMS:
            raise ConfigurationError(
                f"`terms`: there is no {shown(name)}; there are {', '.join(TERMS)}"
            )
    return tuple(terms)


def with_terms(setup: Setup, terms: Sequence[str]) -> Setup:
    """Return `setup` with exactly these motion terms switched on.

    Raises:
        ConfigurationError: there is no such term.
    """
    chosen = require_terms(terms)
    switches = {name: name in chosen for name in TERMS}
    return replace(setup, correction=replace(setup.correction, **switches))
