"""The parts of the page that ask a robot for something, or show tables."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

import yaml
from nicegui import events, ui

from ..errors import TwbrError
from .source import ParameterInfo, ShownOutcome, Source

FILTER_NODE = "filter_node"
FILTER = "filter"
COMPARE = "compare"
SPEED = 0.2
"""Speed that a key or a touch asks for [m/s]."""
YAW_RATE = 1.5
"""[rad/s]."""
FIGURES = [
    {"name": "name", "label": "estimator", "field": "name", "sortable": True, "align": "left"},
    {"name": "mse", "label": "MSE [deg^2]", "field": "mse", "sortable": True},
    {"name": "bias", "label": "bias [deg]", "field": "bias", "sortable": True},
    {"name": "delay", "label": "delay [ms]", "field": "delay", "sortable": True},
]
ICONS = {"OK": "check_circle", "WARN": "warning", "ERROR": "error", "STALE": "schedule"}


def show(outcome: ShownOutcome) -> None:
    """Show the result of a request for some seconds."""
    ui.notify(outcome.text, type="positive" if outcome.done else "negative", timeout=6000)


class FilterPanel:
    """Chooses the active filter and shows the running figures."""

    def __init__(self, source: Source, read_only: bool) -> None:
        """Build the panel."""
        self._source, self._read_only = source, read_only
        ui.label("Filters").classes("text-subtitle1")
        self._choice = ui.select([], label="active filter", on_change=self._on_choice)
        self._choice.classes("w-full").props("data-mark=filter")
        self._choice.set_visibility(source.live)
        if read_only:
            self._choice.disable()
        self._table = ui.table(columns=FIGURES, rows=[], row_key="name").classes("w-full")
        self._table.props('dense hide-pagination :rows-per-page-options="[0]"')
        ui.button("restart the figures", on_click=source.telemetry.restart_figures).props(
            "flat dense"
        )
        self._known = False
        self._chosen = ""
        if source.live:
            ui.timer(2.0, self._ask, immediate=True)

    async def _ask(self) -> None:
        """Read what there is to choose from, and what is chosen now."""
        if FILTER_NODE not in self._source.nodes():
            return
        try:
            found = {each.name: each for each in await self._source.parameters(FILTER_NODE)}
        except TwbrError:
            return
        if FILTER in found:
            self._chosen = str(found[FILTER].value)
            self._choice.set_options(list(found[FILTER].choices), value=self._chosen)

    async def _on_choice(self, event: events.ValueChangeEventArguments[str]) -> None:
        if not event.value or event.value == self._chosen:
            return
        outcome = await self._source.set_parameter(FILTER_NODE, FILTER, event.value)
        show(outcome)
        if outcome.done:
            self._chosen = event.value
            self._source.telemetry.restart_figures()
        else:
            self._choice.set_value(self._chosen)

    def refresh(self) -> None:
        """Bring the table up to date."""
        rows = [sums.row(name) for name, sums in self._source.telemetry.sums.items()]
        if rows != self._table.rows:
            self._table.rows = rows
            self._table.update()


class ParameterPanel:
    """Every parameter of a node as a slider, a switch or a field, with its bounds and text."""

    def __init__(self, source: Source, read_only: bool) -> None:
        """Build the panel."""
        self._source, self._read_only = source, read_only
        self._found: list[ParameterInfo] = []
        ui.label("Parameters").classes("text-subtitle1")
        with ui.row().classes("w-full items-center no-wrap"):
            self._node = ui.select([], label="node", on_change=self._load).classes("grow")
            ui.button(icon="refresh", on_click=self._load).props("flat dense")
        self._search = (
            ui.input("search", on_change=self._fill).classes("w-full").props("data-mark=search")
        )
        self._search.props("clearable dense")
        self._all = ui.switch("all filters and controllers", on_change=self._fill)
        self._list = ui.scroll_area().classes("w-full h-96")
        ui.button("save as filters.yaml", icon="download", on_click=self._save).props("flat dense")
        ui.timer(2.0, self._find_nodes, immediate=True)

    def _find_nodes(self) -> None:
        names = list(self._source.nodes())
        if names != self._node.options:
            chosen = self._node.value if self._node.value in names else None
            preferred = FILTER_NODE if FILTER_NODE in names else None
            self._node.set_options(names, value=chosen or preferred)

    async def _load(self) -> None:
        if not self._node.value:
            return
        try:
            self._found = list(await self._source.parameters(self._node.value))
        except TwbrError as error:
            show(ShownOutcome(False, str(error)))
            return
        self._fill()

    def _shown(self) -> list[ParameterInfo]:
        """Return the parameters that match the search, without those of inactive filters."""
        wanted = (self._search.value or "").lower()
        by_name = {each.name: each for each in self._found}
        choices, active = set[str](), set[str]()
        for name in (FILTER, "controller"):
            if name in by_name:
                choices.update(by_name[name].choices)
                active.add(str(by_name[name].value))
        kept = []
        for each in self._found:
            owner = each.name.partition(".")[0]
            inactive = owner in choices and owner not in active
            if wanted in each.name.lower() and (self._all.value or wanted or not inactive):
                kept.append(each)
        return kept

    def _fill(self) -> None:
        self._list.clear()
        with self._list:
            for each in self._shown():
                self._editor(each)

    def _editor(self, info: ParameterInfo) -> None:
        disabled = self._read_only or info.read_only
        with ui.column().classes("w-full gap-0"):
            element = self._input(info)
            if info.description:
                ui.label(info.description).classes("text-caption text-grey")
            if disabled:
                element.disable()

    def _input(self, info: ParameterInfo) -> Any:
        """Return the element that fits the type, the bounds and the choices."""
        value = info.value

        def changed(convert: Callable[[Any], Any]) -> Callable[..., Coroutine[Any, Any, None]]:
            async def change(event: Any) -> None:
                await self._change(info, convert(getattr(event, "value", event)))

            return change

        if isinstance(value, bool):
            return ui.switch(info.name, value=value, on_change=changed(bool)).props(
                f"data-mark={info.name}"
            )
        if info.choices:
            return (
                ui.select(list(info.choices), label=info.name, value=value, on_change=changed(str))
                .classes("w-full")
                .props(f"data-mark={info.name}")
            )
        if isinstance(value, (int, float)):
            return self._number(info)
        field = ui.input(info.name, value=yaml.safe_dump(value, default_flow_style=True).strip())
        field.classes("w-full").props("dense").props(f"data-mark={info.name}")
        field.on("change", lambda: self._change(info, yaml.safe_load(field.value)))
        return field

    def _number(self, info: ParameterInfo) -> Any:
        """Return a field; with bounds that are near enough, a slider moves it as well."""
        convert = int if isinstance(info.value, int) else float
        limits = ""
        if info.minimum is not None and info.maximum is not None:
            limits = f" ({info.minimum:g} to {info.maximum:g})"
        field = ui.number(f"{info.name}{limits}", value=info.value, format="%.6g")
        field.classes("w-full").props("dense").props(f"data-mark={info.name}")

        async def change() -> None:
            if field.value is not None:
                await self._change(info, convert(field.value))

        field.on("change", change)
        if not limits or self._read_only or info.read_only:
            return field
        assert info.minimum is not None and info.maximum is not None
        step = (info.maximum - info.minimum) / 200.0 if convert is float else 1
        slider = ui.slider(min=info.minimum, max=info.maximum, step=step, value=info.value)
        slider.props("dense")

        async def slide(event: events.GenericEventArguments) -> None:
            field.set_value(convert(event.args))
            await change()

        slider.on("change", slide)
        return field

    async def _change(self, info: ParameterInfo, value: Any) -> None:
        outcome = await self._source.set_parameter(self._node.value, info.name, value)
        show(outcome)
        await self._load()  # a refused value goes back to the one in force

    async def _save(self) -> None:
        """Offer the filter node's settings as a parameter file."""
        try:
            found = await self._source.parameters(FILTER_NODE)
        except TwbrError as error:
            show(ShownOutcome(False, str(error)))
            return
        ui.download(settings_yaml(found).encode(), "filters.yaml")


def settings_yaml(found: list[ParameterInfo] | Any) -> str:
    """Return the filter, its parameters and those of the correction as a ROS parameter file."""
    by_name = {each.name: each.value for each in found}
    filters = next((each.choices for each in found if each.name == FILTER), ())
    owners = {*filters, "correction"}
    parameters: dict[str, Any] = {}
    for name in (FILTER, "settings_dt"):
        if by_name.get(name):
            parameters[name] = by_name[name]
    for name, value in by_name.items():
        owner, _, key = name.partition(".")
        if key and owner in owners and value != []:
            parameters.setdefault(owner, {})[key] = value
    return yaml.safe_dump({"/**": {"ros__parameters": parameters}}, sort_keys=False)


class ActionPanel:
    """Buttons for services, the recorder, and driving by keys and touch."""

    KEYS = {  # noqa: RUF012 - a constant
        "w": (SPEED, 0.0),
        "s": (-SPEED, 0.0),
        "a": (0.0, YAW_RATE),
        "d": (0.0, -YAW_RATE),
        "ArrowUp": (SPEED, 0.0),
        "ArrowDown": (-SPEED, 0.0),
        "ArrowLeft": (0.0, YAW_RATE),
        "ArrowRight": (0.0, -YAW_RATE),
    }

    def __init__(self, source: Source, read_only: bool) -> None:
        """Build the panel."""
        self._source = source
        self._names: tuple[str, ...] = ()
        self._read_only = read_only
        self._held: tuple[float, float] | None = None
        self._buttons = ui.row().classes("w-full")
        if read_only:
            ui.label("This page is read-only.").classes("text-caption text-grey")
            return
        pad = ui.joystick(color="#1976d2", size=70, throttle=0.05, on_end=self._let_go)
        pad.on_move(lambda event: self._drive((SPEED * event.y, -YAW_RATE * event.x)))
        ui.label("Drive with the pad or w a s d, push with q and e.").classes("text-caption")
        ui.keyboard(on_key=self._on_key)
        ui.timer(0.1, self._repeat)

    def refresh(self) -> None:
        """Show a button for each thing that can be done now."""
        names = () if self._read_only else tuple(self._source.actions())
        if names == self._names:
            return
        self._names = names
        self._buttons.clear()
        with self._buttons:
            for name in names:
                ui.button(name, on_click=self._acting(name)).props("dense no-caps").props(
                    f'data-mark="{name}"'
                )

    def _acting(self, name: str) -> Callable[[], Coroutine[Any, Any, None]]:
        async def act() -> None:
            show(await self._source.act(name))

        return act

    async def _on_key(self, event: events.KeyEventArguments) -> None:
        key = event.key.name
        if event.action.repeat:
            return
        if key in self.KEYS:
            self._drive(self.KEYS[key] if event.action.keydown else (0.0, 0.0))
        elif event.action.keydown and key in ("q", "e"):
            name = "push back" if key == "q" else "push forward"
            if name in self._names:
                show(await self._source.act(name))

    def _drive(self, command: tuple[float, float]) -> None:
        self._held = command if command != (0.0, 0.0) else None
        self._source.drive(*command)

    def _let_go(self) -> None:
        self._drive((0.0, 0.0))

    def _repeat(self) -> None:
        """Repeat a held command, as a joystick does: a controller drops an old one."""
        if self._held is not None:
            self._source.drive(*self._held)


class DiagnosticsPanel:
    """The state of every node, and how the topics arrive."""

    TOPICS = [  # noqa: RUF012 - a constant
        {"name": "topic", "label": "topic", "field": "topic", "align": "left", "sortable": True},
        {"name": "rate", "label": "1/s", "field": "rate", "sortable": True},
        {"name": "age", "label": "age [s]", "field": "age", "sortable": True},
    ]

    def __init__(self, source: Source) -> None:
        """Build the panel."""
        self._source = source
        self._shown: object = None
        ui.label("Diagnostics").classes("text-subtitle1")
        self._nodes = ui.column().classes("w-full gap-1").props("data-mark=diagnostics")
        self._table = ui.table(columns=self.TOPICS, rows=[], row_key="topic").classes("w-full")
        self._table.props('dense hide-pagination :rows-per-page-options="[0]"')

    def refresh(self) -> None:
        """Bring both up to date."""
        statuses = self._source.statuses()
        shown = [(each.name, each.level, each.message, each.values) for each in statuses]
        if shown != self._shown:
            self._shown = shown
            self._fill()
        rows = [
            {"topic": each.topic, "rate": round(each.rate, 1), "age": _age(each.age)}
            for each in self._source.rates()
        ]
        if rows != self._table.rows:
            self._table.rows = rows
            self._table.update()

    def _fill(self) -> None:
        self._nodes.clear()
        with self._nodes:
            for each in self._source.statuses():
                title = f"{each.name}: {each.message}"
                with ui.expansion(title, icon=ICONS.get(each.level, "help")).classes("w-full"):
                    for key, value in each.values.items():
                        ui.label(f"{key}: {value}").classes("text-caption")


def _age(seconds: float) -> str:
    return "never" if seconds == float("inf") else f"{seconds:.2f}"


class PlaybackPanel:
    """A slider for the time of a recording."""

    def __init__(self, source: Source) -> None:
        """Build the panel."""
        self._source = source
        length = source.duration()
        self._slider = ui.slider(min=0.0, max=length, step=0.01, value=0.0)
        self._slider.on("change", lambda event: source.seek(float(event.args)))
        self._slider.props("data-mark=time")
        with ui.row():
            for name in ("play", "pause"):
                ui.button(name, on_click=self._acting(name)).props("dense no-caps").props(
                    f'data-mark="{name}"'
                )
        self._label = ui.label("")

    def _acting(self, name: str) -> Callable[[], Coroutine[Any, Any, None]]:
        async def act() -> None:
            await self._source.act(name)

        return act

    def refresh(self) -> None:
        """Show the time of the picture."""
        self._label.set_text(self._source.words()[0])
