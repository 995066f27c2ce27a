"""Compiled steps for correction and filters, where they have been prepared."""

import threading
from functools import cache
from typing import NamedTuple

from ..filters.base import Filter, filters
from . import files
from .layout import LayoutError
from .loading import Function, loaded
from .running import CompiledStep
from .steps import CORRECTION, StepLayouts, correction_layouts, filter_layouts


class _Found(NamedTuple):
    function: Function
    layouts: StepLayouts


def _found(name: str, entry: Filter | None) -> _Found | None:
    """Return a step that has been prepared for this computer; None where there is none."""
    try:
        layouts = correction_layouts() if entry is None else filter_layouts(entry)
    except LayoutError:
        return None
    function = loaded(name)
    return None if function is None else _Found(function, layouts)


def compiled_correction() -> CompiledStep | None:
    """Return the compiled step of the correction; None where there is none."""
    found = _found(CORRECTION, None)
    return None if found is None else CompiledStep(*found)


def compiled_filter(entry: Filter) -> CompiledStep | None:
    """Return the compiled step of a filter and its monitor; None where there is none."""
    found = _found(entry.name, entry)
    return None if found is None else CompiledStep(*found)


class BackgroundSteps:
    """Every step that has been prepared, loaded by a thread while samples already flow."""

    def __init__(self) -> None:
        """Start loading, if there is anything to load."""
        self.ready = False
        """Whether all is there that will be."""
        self.refusal = ""
        """Why a step that is there was not loaded, in one sentence; empty without reason."""
        self._found: dict[str, _Found] = {}
        kept = files.kept_names()
        names = [name for name in (CORRECTION, *filters()) if name in kept]
        if names:
            threading.Thread(target=self._load, args=(names,), daemon=True).start()
        else:
            self.ready = True

    def _load(self, names: list[str]) -> None:
        try:
            for name in names:
                found = _found(name, filters().get(name))
                if found is not None:
                    self._found[name] = found
                else:
                    self.refusal = self.refusal or files.refused(name)
        finally:
            self.ready = True

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the steps that are there."""
        return tuple(self._found)

    def correction(self) -> CompiledStep | None:
        """Return a step of the correction; None where there is none."""
        return self._step(CORRECTION)

    def of_filter(self, entry: Filter) -> CompiledStep | None:
        """Return a step of a filter; None where there is none."""
        return self._step(entry.name)

    def _step(self, name: str) -> CompiledStep | None:
        found = self._found.get(name)
        return None if found is None else CompiledStep(*found)


@cache
def background_steps() -> BackgroundSteps:
    """Return those of this process; the first call starts loading them."""
    return BackgroundSteps()
