"""Buttons for services and the recorder, and a pad to drive with keys or a finger."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from nicegui import ui

from .notices import Notices
from .source import Source

ENDS = ("disable", "stop recording")
"""Actions drawn in another colour: the motors are cut, a recording ends."""


class ActionPanel:
    """What can be done now; `live.js` drives, and pushes with q and e."""

    def __init__(self, source: Source, read_only: bool) -> None:
        """Build the panel."""
        self._source, self._read_only = source, read_only
        self._notices = Notices()
        self._names: tuple[str, ...] = ()
        self._buttons = ui.row().classes("w-full twbr-actions")
        self.pad: int | None = None
        """Element that is the pad; None where nothing may be driven."""
        if read_only:
            ui.label("This page is read-only.").classes("text-caption text-grey")
            return
        with ui.row().classes("w-full items-center no-wrap"):
            with ui.element("div").classes("twbr-pad").props("data-mark=pad") as pad:
                ui.element("div").classes("twbr-knob")
            self.pad = pad.id
            ui.label(
                "Drive with the pad, w a s d or the arrows; push with q and e. "
                "The robot stops when you let go, leave the page or lose the connection."
            ).classes("text-caption")

    def refresh(self) -> None:
        """Show a button for each thing that can be done now."""
        names = () if self._read_only else tuple(self._source.actions())
        if names == self._names:
            return
        self._names = names
        self._buttons.clear()
        with self._buttons:
            for name in names:
                button = ui.button(name, on_click=self._acting(name)).props("dense no-caps")
                button.props(f'data-mark="{name}"')
                if name in ENDS:
                    button.props("color=negative")

    def _acting(self, name: str) -> Callable[[], Coroutine[Any, Any, None]]:
        async def act() -> None:
            self._notices.show(await self._source.act(name))

        return act
