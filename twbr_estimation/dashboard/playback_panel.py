"""A slider for the time of a recording."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from nicegui import ui

from .source import Source


class PlaybackPanel:
    """Goes to a time, plays and pauses; shows the warnings about the recording."""

    def __init__(self, source: Source) -> None:
        """Build the panel."""
        self._source = source
        self._dragged = False
        self._slider = ui.slider(min=0.0, max=source.duration(), step=0.01, value=0.0)
        self._slider.on("change", lambda event: source.seek(float(event.args)))
        self._slider.on("pan", self._pan)
        self._slider.props("data-mark=time")
        with ui.row():
            for name in ("play", "pause"):
                button = ui.button(name, on_click=self._acting(name)).props("dense no-caps")
                button.props(f'data-mark="{name}"')
        for each in source.statuses():
            ui.label(each.message).classes("text-caption")

    def _acting(self, name: str) -> Callable[[], Coroutine[Any, Any, None]]:
        async def act() -> None:
            await self._source.act(name)

        return act

    def _pan(self, event: Any) -> None:
        self._dragged = event.args == "start"

    def refresh(self) -> None:
        """Show the time of the picture; a slider that is being dragged stays with the finger."""
        if not self._dragged:
            self._slider.set_value(round(self._source.position(), 2))
