"""Result of an import, and its files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType

import numpy as np

from ..bags import write_recording
from ..bags.cleaning import Cleaner
from ..bags.decoding import Columns
from ..configuration.files import write_section, write_settings
from ..configuration.filter_settings import Settings
from ..configuration.of_recording import CONFIG_FOLDER
from ..errors import RecordingError
from ..recording import FloatArray, Recording, StampArray
from ..robot import Calibration, CorrectionSettings, Robot

START = 1_000_000_000
"""Stamp of the first sample of logs without a date [ns]."""


@dataclass(frozen=True, slots=True)
class ImportOptions:
    """Options of a format besides the file."""

    description: Path | None = None
    """YAML file that describes the columns (csv)."""
    axis: str = "y"
    """Sensor axis taken as the tilt axis (broad)."""


@dataclass(frozen=True, slots=True)
class ImportedLog:
    """A recording with what is known about its robot."""

    recording: Recording
    robot: Robot
    calibration: Calibration = field(default_factory=Calibration)
    correction: CorrectionSettings | None = None
    """Settings that suit the log's wheel encoder, where the defaults do not."""
    provenance: Mapping[str, str | float] = field(default_factory=dict)
    """Origin of calibration values."""


@lru_cache(maxsize=1)
def formats() -> Mapping[str, ModuleType]:
    """Return the modules of this folder that define a format, by the format's name."""
    package = __name__.rpartition(".")[0]
    names = (entry.name for entry in iter_modules(import_module(package).__path__))
    modules = {name: import_module(f"{package}.{name}") for name in names}
    found = {name: module for name, module in modules.items() if hasattr(module, "FORMAT")}
    return {name.removesuffix("_log").replace("_", "-"): found[name] for name in sorted(found)}


def load(path: Path, name: str, options: ImportOptions | None = None) -> ImportedLog:
    """Read a log of the named format.

    Raises:
        RecordingError: unknown format, or a file that is not of that format.
    """
    if name not in formats():
        raise RecordingError(f"there is no format {name!r}; there are: {', '.join(formats())}")
    if not path.exists():
        raise RecordingError(f"{path}: there is no such file")
    log: ImportedLog = formats()[name].load(path, options or ImportOptions())
    return log


def write_import(path: Path, log: ImportedLog, overwrite: bool = False) -> None:
    """Write the recording and, in its folder `config`, robot and calibration.

    Raises:
        RecordingError: the recording exists and `overwrite` is not set.
        WritingError: it cannot be written.
    """
    provenance = {"source": log.recording.source, **log.provenance}

    def describe(folder: Path) -> None:
        config = folder / CONFIG_FOLDER
        write_section(config / "robot.yaml", log.robot, provenance)
        write_section(config / "calibration.yaml", log.calibration, provenance)
        if log.correction is not None:
            write_settings(config / "filters.yaml", Settings(), log.correction, provenance)

    write_recording(path, log.recording, overwrite=overwrite, beside=describe)


def uniform_stamps(count: int, rate: float) -> StampArray:
    """Return stamps [ns] of a regular clock of `rate` [Hz]."""
    return stamps_from_seconds(np.arange(count) / rate, 0.0)


def stamps_from_seconds(seconds: FloatArray, first: float) -> StampArray:
    """Return stamps [ns] with the time `first` [s] at `START`."""
    stamps: StampArray = START + np.rint((seconds - first) * 1e9).astype(np.int64)
    return stamps


def cleaned(
    name: str, stamps: StampArray, values: FloatArray, repairs: Counter[str]
) -> tuple[StampArray, FloatArray]:
    """Return stamps and (n, k) values repaired as those of a bag's topic.

    Raises:
        RecordingError: nothing is left.
    """
    order = np.arange(stamps.size, dtype=np.int64)
    frames = np.full(stamps.size, "", dtype=object)
    columns = Columns(stamps, order, values, frames)
    columns = Cleaner(name, repairs).clean(columns, slice(None))
    if not columns.stamps.size:
        raise RecordingError(f"{name}: none of {stamps.size} samples is usable")
    return columns.stamps, columns.values
