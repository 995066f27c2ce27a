"""Tables, progress and coloured text on a terminal."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from .text import safe


class SafeConsole(Console):
    """A console on which only its own styles write escape codes."""

    def render_str(self, text: str, *arguments: Any, **named: Any) -> Text:
        """Return a text with its control characters spelled, before its width is measured."""
        return super().render_str(safe(text), *arguments, **named)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Yield the segments of anything that did not come as a string, too."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(safe(segment.text), segment.style)
