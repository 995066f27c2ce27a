"""The errors this package raises, all below one base class.

Each message names what was wrong (file, topic, parameter), the value found and the limit
it broke. Library code raises; nodes log; the command line prints and exits with status 1.
"""

from __future__ import annotations


class TwbrError(Exception):
    """Base of every error raised on purpose by this package."""


class ConfigurationError(TwbrError):
    """A parameter, settings file or robot description that cannot be used."""


class RecordingError(TwbrError):
    """A recording that cannot be read or does not hold what was asked of it."""


class SensorError(TwbrError):
    """A sensor or bus that does not answer as its data sheet says."""


class MessageError(TwbrError):
    """A serialised message that does not have the layout of its type."""


class MotionError(TwbrError):
    """A robot that moved where it had to stand still."""


class CalibrationError(TwbrError):
    """Readings that would be calibrated into nonsense."""


class WorkerError(TwbrError):
    """Workers that died, cannot be reached, or are stopped on request."""


class WritingError(TwbrError):
    """A file or folder that cannot be written; what was there before is unchanged."""
