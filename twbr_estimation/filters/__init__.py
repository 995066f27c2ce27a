"""Tilt filters, one a file; see `base` for what a filter is."""

import sys
from collections.abc import Mapping
from types import ModuleType

from .base import (
    Bounds,
    Filter,
    Matrices,
    Parameter,
    estimate_of,
    filter_named,
    filters,
    is_filter,
    listed_filters,
)

__all__ = [
    "Bounds",
    "Filter",
    "Matrices",
    "Parameter",
    "estimate_of",
    "filter_named",
    "filters",
    "is_filter",
    "listed_filters",
]


class _Folder(ModuleType):
    """This folder, which `twbr_estimation.filters()` calls: both have one name."""

    def __call__(self) -> Mapping[str, Filter]:
        """Return the filters to choose among by name; `filter_named` has the historical, too."""
        return listed_filters()


sys.modules[__name__].__class__ = _Folder
