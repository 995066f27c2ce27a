"""Results of requests, shown for some seconds in the browser that asked."""

from __future__ import annotations

from nicegui import ui

from .source import ShownOutcome

SHOWN_FOR = 6.0
"""[s]."""


class Notices:
    """Shows outcomes on the page that is being built where this is created.

    A request may take longer than the button lives that made it; the page outlives both.
    """

    def __init__(self) -> None:
        """Remember the page."""
        self._client = ui.context.client

    def show(self, outcome: ShownOutcome) -> None:
        """Show what was done, or why it was refused."""
        with self._client:
            ui.notify(
                outcome.text,
                type="positive" if outcome.done else "negative",
                timeout=1e3 * SHOWN_FOR,
                multi_line=True,
            )
