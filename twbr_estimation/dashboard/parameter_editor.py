"""One parameter of a node as a slider, a switch, a list or a field."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

from nicegui import events, ui

from ..errors import ConfigurationError
from .source import ParameterInfo
from .values import text_of_value, value_of_text, whole

STEPS = 200
"""Steps of a slider between its limits."""

Change = Callable[[str, Any], Awaitable[None]]
Refuse = Callable[[str, str], None]


class ParameterEditor:
    """Shows the value in force with limits and text, and asks for another one."""

    def __init__(self, info: ParameterInfo, disabled: bool, change: Change, refuse: Refuse) -> None:
        """Build the elements into the present container.

        Args:
            info: The parameter.
            disabled: Whether it is only shown.
            change: Asks for a new value of the parameter of this name.
            refuse: Shows why a text is no value of it.
        """
        self._info, self._value = info, info.value
        self._change, self._refuse = change, refuse
        self._slider: ui.slider | None = None
        self._disabled = disabled
        with ui.column().classes("w-full gap-0"):
            self._element = self._build(disabled)
            self._element.props(f'data-mark="{info.name}"')
            if info.description:
                ui.label(info.description).classes("text-caption text-grey")
        self.set_enabled(True)

    def set(self, value: Any) -> None:
        """Show the value in force; a text that was refused goes back to it."""
        self._value = value
        plain = isinstance(value, (bool, int, float)) or bool(self._info.choices)
        self._element.set_value(value if plain else text_of_value(value))
        if self._slider is not None:
            self._slider.set_value(value)

    def set_enabled(self, enabled: bool) -> None:
        """Let the value be changed, or not; one that is only shown never can."""
        for each in (self._element, self._slider):
            if each is not None:
                each.set_enabled(enabled and not self._disabled)

    def _build(self, disabled: bool) -> Any:
        info = self._info
        if isinstance(info.value, bool):
            return ui.switch(info.name, value=info.value, on_change=self._picked)
        if info.choices:
            options = list(dict.fromkeys([*info.choices, str(info.value)]))
            chosen = ui.select(options, label=info.name, value=info.value, on_change=self._picked)
            return chosen.classes("w-full")
        if isinstance(info.value, (int, float)):
            return self._number(disabled)
        field = ui.input(info.name, value=text_of_value(info.value))
        field.classes("w-full").props("dense").on("change", self._typed)
        return field

    def _number(self, disabled: bool) -> Any:
        """Return a field; within limits a slider moves it as well."""
        info = self._info
        low, high = info.minimum, info.maximum
        bounded = low is not None and high is not None
        limits = f" ({low:g} to {high:g})" if bounded else ""
        field = ui.number(f"{info.name}{limits}", value=info.value, format="%.6g")
        field.classes("w-full").props("dense").on("change", self._entered)
        if bounded and not disabled:
            assert low is not None and high is not None
            step = 1.0 if isinstance(info.value, int) else (high - low) / STEPS
            self._slider = ui.slider(min=low, max=high, step=step, value=info.value)
            self._slider.props("dense").on("change", self._slid)
        return field

    async def _picked(self, event: events.ValueChangeEventArguments[Any]) -> None:
        if event.value is not None and event.value != self._value:
            await self._change(self._info.name, event.value)

    async def _slid(self, event: events.GenericEventArguments) -> None:
        await self._ask(lambda: self._converted(float(event.args)))

    async def _entered(self) -> None:
        if self._element.value is not None:
            await self._ask(lambda: self._converted(float(self._element.value)))

    async def _typed(self) -> None:
        await self._ask(lambda: value_of_text(self._element.value or "", self._value))

    def _converted(self, value: float) -> Any:
        return whole(value) if isinstance(self._value, int) else value

    async def _ask(self, read: Callable[[], Any]) -> None:
        try:
            value = read()
        except ConfigurationError as error:
            self._refuse(self._info.name, str(error))
            self.set(self._value)
            return
        await self._change(self._info.name, value)
