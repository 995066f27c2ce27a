"""Compiled steps for correction and filters, where they have been prepared."""

from __future__ import annotations

import gc
import threading
from collections.abc import Callable
from functools import cache, partial
from typing import TYPE_CHECKING

from ..filters.base import Filter, filter_named, filters, is_filter
from . import files
from .files import CORRECTION

if TYPE_CHECKING:  # a node without prepared steps starts without what runs them
    from .running import CompiledStep


def _found(name: str, entry: Filter | None) -> Callable[[], CompiledStep] | None:
    """Return what makes a step prepared for this computer; None where there is none."""
    from .layout import LayoutError
    from .loading import loaded
    from .running import CompiledStep
    from .steps import correction_layouts, filter_layouts

    try:
        layouts = correction_layouts() if entry is None else filter_layouts(entry)
    except LayoutError:
        return None
    function = loaded(name)
    return None if function is None else partial(CompiledStep, function, layouts)


def compiled_correction() -> CompiledStep | None:
    """Return the compiled step of the correction; None where there is none."""
    make = _found(CORRECTION, None)
    return None if make is None else make()


def compiled_filter(entry: Filter) -> CompiledStep | None:
    """Return the compiled step of a filter and its monitor; None where there is none.

    A filter of a user's own has none, whatever its name.
    """
    ours = is_filter(entry.name) and filter_named(entry.name) is entry
    make = _found(entry.name, entry) if ours else None
    return None if make is None else make()


class BackgroundSteps:
    """Every step that has been prepared, loaded by a thread while samples already flow."""

    def __init__(self) -> None:
        """Start loading, if there is anything to load."""
        self.ready = False
        """Whether all is there that will be."""
        self.refusal = ""
        """Why a step that is there was not loaded, in one sentence; empty without reason."""
        self._makes: dict[str, Callable[[], CompiledStep]] = {}
        kept = files.kept_names()
        names = [name for name in (CORRECTION, *filters()) if name in kept]
        if names:
            threading.Thread(target=self._load, args=(names,), daemon=True).start()
        else:
            self.ready = True

    def _load(self, names: list[str]) -> None:
        collecting = gc.isenabled()
        gc.disable()  # a search for garbage in what is loaded takes 0.03 s and stops all threads
        try:
            for name in names:
                make = _found(name, filters().get(name))
                if make is not None:
                    self._makes[name] = make
                else:
                    self.refusal = self.refusal or files.refused(name)
        finally:
            gc.freeze()
            if collecting:
                gc.enable()
            self.ready = True

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the steps that are there."""
        return tuple(self._makes)

    def correction(self) -> CompiledStep | None:
        """Return a step of the correction; None where there is none."""
        return self._step(CORRECTION)

    def of_filter(self, entry: Filter) -> CompiledStep | None:
        """Return a step of a filter; None where there is none."""
        return self._step(entry.name)

    def _step(self, name: str) -> CompiledStep | None:
        make = self._makes.get(name)
        return None if make is None else make()


@cache
def background_steps() -> BackgroundSteps:
    """Return those of this process; the first call starts loading them."""
    return BackgroundSteps()
