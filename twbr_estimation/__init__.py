"""Tilt estimation for two-wheeled balancing robots.

What `__all__` names is the stable surface, which changes with a line in the changelog only.
Everything else may change with any version. Names are loaded when they are first used, so that
importing the package costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .bags.topics import TopicNames as TopicNames
    from .configuration.files import read_settings as read_settings
    from .configuration.files import read_setup as read_setup
    from .configuration.filter_settings import Settings as Settings
    from .drives.drive import Drive as Drive
    from .drives.loading import load as load
    from .drives.runs import Runs as Runs
    from .drives.simulated import simulate as simulate
    from .errors import TwbrError as TwbrError
    from .filters.base import Filter as Filter
    from .filters.base import filters as filters
    from .parameters.bounds import Bounds as Bounds
    from .recording import ImuTrack as ImuTrack
    from .recording import MotorTrack as MotorTrack
    from .recording import Recording as Recording
    from .recording import TiltTrack as TiltTrack
    from .recording import WheelTrack as WheelTrack
    from .robot import Calibration as Calibration
    from .robot import CorrectionSettings as CorrectionSettings
    from .robot import Robot as Robot
    from .robot import Setup as Setup
    from .samples import CorrectedSample as CorrectedSample
    from .samples import TiltEstimate as TiltEstimate
    from .scoring.score import ScoringOptions as ScoringOptions
    from .streams.estimator import Estimator as Estimator

__version__ = "0.2.0"

__all__ = [
    "Bounds",
    "Calibration",
    "CorrectedSample",
    "CorrectionSettings",
    "Drive",
    "Estimator",
    "Filter",
    "ImuTrack",
    "MotorTrack",
    "Recording",
    "Robot",
    "Runs",
    "ScoringOptions",
    "Settings",
    "Setup",
    "TiltEstimate",
    "TiltTrack",
    "TopicNames",
    "TwbrError",
    "WheelTrack",
    "__version__",
    "filters",
    "load",
    "read_settings",
    "read_setup",
    "simulate",
]

_HOMES = {
    "Bounds": "parameters.bounds",
    "Calibration": "robot",
    "CorrectedSample": "samples",
    "CorrectionSettings": "robot",
    "Drive": "drives.drive",
    "Estimator": "streams.estimator",
    "Filter": "filters.base",
    "ScoringOptions": "scoring.score",
    "Recording": "recording",
    "WheelTrack": "recording",
    "TiltTrack": "recording",
    "MotorTrack": "recording",
    "ImuTrack": "recording",
    "Robot": "robot",
    "Runs": "drives.runs",
    "Settings": "configuration.filter_settings",
    "Setup": "robot",
    "TiltEstimate": "samples",
    "TopicNames": "bags.topics",
    "TwbrError": "errors",
    "filters": "filters",
    "load": "drives.loading",
    "read_settings": "configuration.files",
    "read_setup": "configuration.files",
    "simulate": "drives.simulated",
}


def __getattr__(name: str) -> Any:
    """Load a public name from its module (PEP 562)."""
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = import_module(f"{__name__}.{_HOMES[name]}")
    value = home if name == "filters" else getattr(home, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names, for completion."""
    return sorted({*globals(), *__all__})
