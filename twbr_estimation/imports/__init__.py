"""Logs of other origins as recordings: one format a file, collected by name.

A format is a module of this folder with `FORMAT`, a line for the command line, and
`load(path, options) -> ImportedLog`. Whatever the format, sensors come out in the axes of
REP-103 (x forward, y left, z up), with all three axes of gyro and accelerometer.
"""

from __future__ import annotations

from .imported import ImportedLog, ImportOptions, formats, load, write_import

__all__ = ["ImportOptions", "ImportedLog", "formats", "load", "write_import"]
