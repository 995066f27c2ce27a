"""Choose the active filter, and compare the running figures of all."""

from __future__ import annotations

from nicegui import events, ui

from ..errors import TwbrError
from .notices import Notices
from .parameter_panel import FILTER, FILTER_NODE, LOOK
from .source import Source
from .telemetry import ACTIVE

FIGURES = [
    {"name": "name", "label": "estimator", "field": "name", "sortable": True, "align": "left"},
    {"name": "mse", "label": "MSE [deg^2]", "field": "mse", "sortable": True},
    {"name": "bias", "label": "bias [deg]", "field": "bias", "sortable": True},
    {"name": "delay", "label": "delay [ms]", "field": "delay", "sortable": True},
]
TABLE = 'dense wrap-cells hide-pagination :rows-per-page-options="[0]"'


class FilterPanel:
    """Chooses the active filter and shows the running figures."""

    def __init__(self, source: Source, read_only: bool) -> None:
        """Build the panel."""
        self._source = source
        self._notices = Notices()
        self._chosen, self._revision = source.active, -1
        self._read_only, self._present = read_only, True
        ui.label("Filters").classes("text-subtitle1")
        self._choice = ui.select([], label="active filter", on_change=self._on_choice)
        self._choice.classes("w-full").props("data-mark=filter")
        self._choice.set_visibility(source.live)
        if read_only:
            self._choice.disable()
        self._table = ui.table(columns=FIGURES, rows=[], row_key="name").classes("w-full")
        self._table.props(f"{TABLE} data-mark=figures")
        if not read_only:
            restart = ui.button("restart the figures", on_click=source.telemetry.restart_figures)
            restart.props("flat dense no-caps")
        if source.live:
            ui.timer(LOOK, self._look, immediate=True)

    async def _look(self) -> None:
        """Read which filter is active where the node has changed."""
        present = FILTER_NODE in self._source.nodes()
        self._offer(present)
        revision = self._source.revision(FILTER_NODE)
        if not present or revision == self._revision:
            return
        try:
            found = {each.name: each for each in await self._source.parameters(FILTER_NODE)}
        except TwbrError:
            return
        self._revision = revision
        if FILTER in found:
            self._take(str(found[FILTER].value))
            self._choice.set_options(list(found[FILTER].choices), value=self._chosen)

    def _offer(self, present: bool) -> None:
        """Let the filter be chosen while its node is there; one that is back is read anew."""
        if present == self._present:
            return
        self._present, self._revision = present, -1
        self._choice.set_enabled(present and not self._read_only)
        if present:
            self._choice.props(remove="hint")
        else:
            self._choice.props(f'hint="{FILTER_NODE} is not found"')

    def _take(self, name: str) -> None:
        """Clear the figures where another filter has become the active one."""
        if self._chosen and name != self._chosen:
            self._source.telemetry.restart_figures()
        self._chosen = name

    async def _on_choice(self, event: events.ValueChangeEventArguments[str]) -> None:
        if not event.value or event.value == self._chosen:
            return
        outcome = await self._source.set_parameter(FILTER_NODE, FILTER, event.value)
        self._notices.show(outcome)
        if outcome.done:
            self._take(event.value)
        else:
            self._choice.set_value(self._chosen)

    def refresh(self) -> None:
        """Bring the table up to date."""
        titles = {ACTIVE: f"{ACTIVE}: {self._chosen}"} if self._chosen else {}
        sums = tuple(self._source.telemetry.sums.items())
        rows = [each.row(titles.get(name, name)) for name, each in sums]
        if rows != self._table.rows:
            self._table.rows = rows
            self._table.update()
