"""Tilt filters, one a file; see `base` for what a filter is."""

from .base import Bounds, Filter, Matrices, Parameter, estimate_of, filter_named, filters

__all__ = ["Bounds", "Filter", "Matrices", "Parameter", "estimate_of", "filter_named", "filters"]
