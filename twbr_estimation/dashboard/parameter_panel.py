"""Every parameter of a node, and the settings of the filter node as a file."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from ..errors import TwbrError
from .notices import Notices
from .parameter_editor import ParameterEditor
from .source import ParameterInfo, ShownOutcome, Source
from .values import settings_yaml

FILTER_NODE = "filter_node"
FILTER = "filter"
CONTROLLER = "controller"
LOOK = 1.0
"""Time between two looks for other nodes and changed parameters [s]."""


class ParameterPanel:
    """The parameters of one node; a change from elsewhere is shown as well."""

    def __init__(self, source: Source, read_only: bool) -> None:
        """Build the panel."""
        self._source, self._read_only = source, read_only
        self._notices = Notices()
        self._found: list[ParameterInfo] = []
        self._editors: dict[str, ParameterEditor] = {}
        self._laid_out: object = None
        self._read: object = None
        """Node and revision that are shown."""
        self._shown_node = ""
        self._lost = ""
        """The chosen node where it is no longer in the graph."""
        ui.label("Parameters").classes("text-subtitle1")
        with ui.row().classes("w-full items-center no-wrap"):
            self._node = ui.select({}, label="node", on_change=lambda: self._load()).classes("grow")
            self._node.props("data-mark=node")
            ui.button(icon="refresh", on_click=lambda: self._load()).props("flat dense")
        self._reason = ui.label("").classes("text-orange-9").props("data-mark=lost")
        self._search = ui.input("search", on_change=self._fill).classes("w-full")
        self._search.props("clearable dense data-mark=search")
        self._all = ui.switch("all filters and controllers", on_change=self._fill)
        self._list = ui.scroll_area().classes("w-full h-96")
        save = ui.button("save as filters.yaml", icon="download", on_click=self._save)
        save.props("flat dense no-caps data-mark=save")
        ui.timer(LOOK, self._look, immediate=True)

    async def _look(self) -> None:
        """Find the nodes; read again what has changed."""
        self._list_nodes()
        node = self._node.value
        if node and not self._lost and (node, self._source.revision(node)) != self._read:
            await self._load(aloud=False)

    def _list_nodes(self) -> None:
        """Offer the nodes; the chosen one stays where it is lost, with its last values."""
        names, node = list(self._source.nodes()), self._node.value
        self._mark_lost(node if node and node not in names else "")
        options = {each: each for each in names}
        if self._lost:
            options[self._lost] = f"{self._lost} (lost)"
        if options != self._node.options:
            preferred = FILTER_NODE if FILTER_NODE in names else None
            self._node.set_options(options, value=node or preferred)

    def _mark_lost(self, node: str) -> None:
        """Disable the values of a node that is lost; one that is back is read anew."""
        if node == self._lost:
            return
        self._lost, self._read = node, None
        reason = f"{node} is lost; its last values are shown and cannot be changed"
        self._reason.set_text(reason if node else "")
        for editor in self._editors.values():
            editor.set_enabled(not node)

    async def _load(self, aloud: bool = True) -> None:
        """Read the parameters of the node; `aloud` shows why it does not answer."""
        node = self._node.value
        if not node:
            return
        if node != self._lost:
            self._list_nodes()
        read = node, self._source.revision(node)
        try:
            self._found = list(await self._source.parameters(node))
        except TwbrError as error:
            if aloud:
                self._notices.show(ShownOutcome(False, str(error)))
            if self._shown_node != node:  # not those of another node under this one's name
                self._found, self._shown_node = [], node
                self._fill()
            return
        self._read, self._shown_node = read, node
        self._fill()

    def _shown(self) -> list[ParameterInfo]:
        """Return the parameters that match the search, without those of inactive filters.

        What is chosen (filter, controller) and its own parameters come first.
        """
        wanted = (self._search.value or "").lower()
        by_name = {each.name: each for each in self._found}
        choices, active = set[str](), set[str]()
        for name in (FILTER, CONTROLLER):
            if name in by_name:
                choices.update(by_name[name].choices)
                active.add(str(by_name[name].value))
        kept = []
        for each in self._found:
            owner = each.name.partition(".")[0]
            inactive = owner in choices and owner not in active
            if wanted in each.name.lower() and (self._all.value or wanted or not inactive):
                kept.append(each)
        first = {FILTER, CONTROLLER, *active}
        return sorted(kept, key=lambda each: each.name.partition(".")[0] not in first)

    def _fill(self) -> None:
        """Show the values; the list is rebuilt only where it has other entries."""
        shown = self._shown()
        layout = [self._node.value, *((each.name, type(each.value)) for each in shown)]
        if layout != self._laid_out:
            self._laid_out = layout
            self._list.clear()
            with self._list:
                self._editors = {each.name: self._editor(each) for each in shown}
            return
        for each in shown:
            self._editors[each.name].set(each.value)

    def _editor(self, info: ParameterInfo) -> ParameterEditor:
        disabled = self._read_only or info.read_only
        editor = ParameterEditor(info, disabled, self._change, self._refuse)
        editor.set_enabled(not self._lost)
        return editor

    def _refuse(self, name: str, reason: str) -> None:
        self._notices.show(ShownOutcome(False, f"{name}: {reason}"))

    async def _change(self, name: str, value: Any) -> None:
        self._notices.show(await self._source.set_parameter(self._node.value, name, value))
        await self._load()  # a refused value goes back to the one in force

    async def _save(self) -> None:
        """Offer the filter node's settings as a parameter file."""
        try:
            found = await self._source.parameters(FILTER_NODE)
        except TwbrError as error:
            self._notices.show(ShownOutcome(False, str(error)))
            return
        ui.download(settings_yaml(found).encode(), "filters.yaml")
