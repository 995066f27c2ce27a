"""The state of every node, and how the topics arrive."""

from __future__ import annotations

import math
from collections.abc import Sequence

from nicegui import ui

from .filter_panel import TABLE
from .source import Source, Status
from .state import losses

ICONS = {"OK": "check_circle", "WARN": "warning", "ERROR": "error", "STALE": "schedule"}
TEXT_COLORS = {"WARN": "text-orange-9", "ERROR": "text-negative", "STALE": "text-grey"}
TOPICS = [
    {"name": "topic", "label": "topic", "field": "topic", "align": "left", "sortable": True},
    {"name": "rate", "label": "1/s", "field": "rate", "sortable": True},
    {"name": "age", "label": "age [s]", "field": "age", "sortable": True},
    {"name": "longest", "label": "longest gap [s]", "field": "longest", "sortable": True},
]


class DiagnosticsPanel:
    """Diagnostics by node, losses, and a table of the topics."""

    def __init__(self, source: Source) -> None:
        """Build the panel."""
        self._source = source
        self._shown: object = None
        self._entries: dict[str, tuple[ui.expansion, ui.label]] = {}
        ui.label("Diagnostics").classes("text-subtitle1")
        self._nodes = ui.column().classes("w-full gap-1").props("data-mark=diagnostics")
        self._losses = ui.label("").classes("text-caption").props("data-mark=losses")
        self._table = ui.table(columns=TOPICS, rows=[], row_key="topic").classes("w-full")
        self._table.props(f"{TABLE} data-mark=topics")

    def refresh(self) -> None:
        """Bring everything up to date."""
        statuses = self._source.statuses()
        shown = [(each.name, each.level, each.message, each.values) for each in statuses]
        if shown != self._shown:
            self._shown = shown
            self._fill()
        rates = self._source.rates()
        lost = losses(statuses, rates, self._source.telemetry.not_finite)
        self._losses.set_text(f"Losses: {'; '.join(lost) or 'none'}")
        rows = [
            {
                "topic": each.topic,
                "rate": round(each.rate, 1),
                "age": "never" if math.isinf(each.age) else round(each.age, 2),
                "longest": round(max(each.longest, each.age if each.longest else 0.0), 2),
            }
            for each in rates
        ]
        if rows != self._table.rows:
            self._table.rows = rows
            self._table.update()

    def _fill(self) -> None:
        statuses = self._source.statuses()
        if [each.name for each in statuses] != list(self._entries):
            self._list_nodes(statuses)
        for each in statuses:
            entry, values = self._entries[each.name]
            entry.set_text(f"{each.name}: {each.message}")
            entry.props(f"icon={ICONS.get(each.level, 'help')}")
            color = TEXT_COLORS.get(each.level, "")
            entry.props(f'header-class="{color}"')
            values.set_text("\n".join(f"{key}: {value}" for key, value in each.values.items()))

    def _list_nodes(self, statuses: Sequence[Status]) -> None:
        """List the nodes in another order; one that is opened stays open."""
        opened = {name for name, (entry, _) in self._entries.items() if entry.value}
        self._nodes.clear()
        self._entries = {}
        with self._nodes:
            for each in statuses:
                with ui.expansion(value=each.name in opened).classes("w-full") as entry:
                    values = ui.label().classes("text-caption whitespace-pre-line")
                self._entries[each.name] = entry, values
