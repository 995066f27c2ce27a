"""A copy of a recording with the smoothed tilt as its reference."""

from __future__ import annotations

import shutil
from pathlib import Path

from ..bags import write_recording
from ..configuration.of_recording import CONFIG_FOLDER
from ..disk.reading import is_folder
from ..errors import ConfigurationError
from .runs import Runs


def save_with_reference(target: Path, runs: Runs, source: Path) -> None:
    """Write a copy of a recording without reference, with its smoothed tilt as reference.

    Args:
        target: directory to create.
        runs: what was run on the recording, smoothing among it.
        source: the recording; its own configuration is copied.

    Raises:
        TwbrError: there is another reference, or the target cannot be written.
    """
    if runs.smoothed is None or runs.drive.recording.reference is not None:
        raise ConfigurationError(f"{source}: has a reference of its own; nothing is saved")

    def describe(folder: Path) -> None:
        if is_folder(source / CONFIG_FOLDER):
            shutil.copytree(source / CONFIG_FOLDER, folder / CONFIG_FOLDER)

    write_recording(target, runs.recording, beside=describe)
