"""The scale on which one parameter is searched."""

from __future__ import annotations

import math

from ..filters.base import Parameter

SMALLEST_SHARE = 1e-8
"""Of the default: where a logarithmic search starts from a bound of zero."""


class SearchAxis:
    """One parameter on the scale that is searched: logarithm, or asinh for signed gains."""

    def __init__(self, parameter: Parameter) -> None:
        """Choose the scale by the parameter's bounds and default."""
        bounds = parameter.bounds
        self._logarithmic = bounds.logarithmic
        span = max(abs(bounds.minimum), abs(bounds.maximum))
        self._unit = abs(parameter.default) or 1e-3 * span
        floor = max(SMALLEST_SHARE * self._unit, 1e-300)
        low = max(bounds.minimum, floor) if self._logarithmic else bounds.minimum
        self.low, self.high = self.scaled(low), self.scaled(bounds.maximum)
        self._limits = bounds.minimum, bounds.maximum

    def scaled(self, value: float) -> float:
        """Return the place of a value on the searched scale."""
        if self._logarithmic:
            return math.log(max(value, 1e-300))
        return math.asinh(value / self._unit)

    def value(self, place: float) -> float:
        """Return the value at a place, within the parameter's bounds."""
        raw = math.exp(place) if self._logarithmic else self._unit * math.sinh(place)
        return min(max(raw, self._limits[0]), self._limits[1])
