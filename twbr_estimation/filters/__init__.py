"""Tilt filters, one a file; see `base` for what a filter is."""

import sys
from collections.abc import Mapping
from types import ModuleType

from .base import Bounds, Filter, Matrices, Parameter, estimate_of, filter_named, filters

__all__ = ["Bounds", "Filter", "Matrices", "Parameter", "estimate_of", "filter_named", "filters"]


class _Folder(ModuleType):
    """This folder, which `twbr_estimation.filters()` calls: both have one name."""

    def __call__(self) -> Mapping[str, Filter]:
        """Return every filter by name."""
        return filters()


sys.modules[__name__].__class__ = _Folder
