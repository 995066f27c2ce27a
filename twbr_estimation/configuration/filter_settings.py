"""Filter settings: parameter values by filter, and the sampling period they were tuned at."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from ..filters import Filter
from ..parameters.argument_checks import number_within, require_kind

DEFAULT_FILTER = "ins_odometer"
"""The active filter where none is named; its defaults are physical and suit any robot
with a calibrated MPU6050, at any sampling period."""
DT_TOLERANCE = 0.05
"""Relative difference of sampling periods above which settings warn."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Values that replace the filters' defaults.

    Raises:
        ConfigurationError: a field of another type, or a period below 0.
    """

    values: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Parameter values by filter name; a filter or parameter not named keeps its defaults."""
    filter: str = DEFAULT_FILTER
    """Name of the active filter."""
    dt: float = 0.0
    """Sampling period the values were tuned at [s]; 0 where unknown."""
    source: str = "the filters' defaults"
    """Origin of the values, for messages."""

    def __post_init__(self) -> None:
        require_kind("values", self.values, Mapping, "a mapping of parameters by filter name")
        for name, each in self.values.items():
            require_kind("values", name, str, "the name of a filter")
            require_kind(f"values[{name!r}]", each, Mapping, "a mapping of parameters to numbers")
        require_kind("filter", self.filter, str, "the name of a filter")
        require_kind("source", self.source, str, "a text")
        object.__setattr__(self, "dt", number_within("dt", self.dt, 0.0, 1e9, "s"))

    def warnings(self, dt: float, entries: Iterable[Filter] = ()) -> tuple[str, ...]:
        """Return warnings about these settings at sampling period `dt`.

        Args:
            dt: Sampling period of the data [s].
            entries: Filters that will run; those without values here are judged by the
                sampling period of their defaults.
        """
        found = []
        if self.values and _differs(self.dt, dt):
            found.append(f"{self.source}: tuned at {self.dt:g} s, used at {dt:g} s")
        untuned: dict[float, list[str]] = {}
        for entry in entries:
            if entry.name not in self.values and _differs(entry.tuned_dt or 0.0, dt):
                untuned.setdefault(entry.tuned_dt or 0.0, []).append(entry.name)
        for tuned_dt, names in untuned.items():
            found.append(
                f"defaults of {', '.join(names)}: tuned at {tuned_dt:g} s, used at {dt:g} s"
            )
        return tuple(found)


def _differs(tuned_dt: float, dt: float) -> bool:
    """Return whether both periods are known and lie apart by more than the tolerance."""
    return tuned_dt > 0.0 and dt > 0.0 and abs(dt / tuned_dt - 1.0) > DT_TOLERANCE
