"""The page: cards that stand side by side on a laptop and below each other on a phone."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from nicegui import background_tasks, ui

from .action_panel import ActionPanel
from .diagnostics_panel import DiagnosticsPanel
from .filter_panel import FilterPanel
from .parameter_panel import ParameterPanel
from .playback_panel import PlaybackPanel
from .source import ShownRobot, Source
from .telemetry import DEGREES, Pose

COLORS = {"OK": "positive", "WARN": "warning", "ERROR": "negative", "STALE": "grey"}
REFRESH = 0.5
"""Time between two updates of the state in words [s]; tables and lists take twice as long."""
SCENE_HEIGHT = 260
"""Of the drawn robot [px]."""
GHOST = "#9e9e9e"
OTHERS = ["#8e24aa", "#7cb342", "#d81b60", "#6d4c41", "#fbc02d", "#00838f", "#5e35b1"]
"""Of the traces that `live.js` gives no colour: the compared filters."""
STYLE = """
.nicegui-content { padding: 8px }
.nicegui-content .q-card { min-width: 0 }
.q-table th, .q-table td { padding: 4px 6px !important; overflow-wrap: anywhere }
.q-table th { white-space: normal }
.q-tab-panels { overflow: clip } .q-tab-panels .q-panel.scroll { overflow: visible }
.twbr-header { position: sticky; top: 0; z-index: 10; padding: 4px 0; background: #fff }
.body--dark .twbr-header { background: var(--q-dark-page) }
.twbr-state { white-space: normal; line-height: 1.3; text-align: left; padding: 4px 8px }
.twbr-pad { position: relative; width: 96px; height: 96px; border-radius: 50%; flex: none;
  background: rgba(25, 118, 210, 0.15); touch-action: none; cursor: pointer }
.twbr-knob { position: absolute; left: 32px; top: 32px; width: 32px; height: 32px;
  border-radius: 50%; background: #1976d2; pointer-events: none }
"""


def build_page(sources: Sequence[Source], read_only: bool) -> None:
    """Build the page of one browser."""
    ui.dark_mode(None)  # as the browser prefers
    ui.add_head_html('<script src="/dashboard/live.js"></script>')
    ui.add_css(STYLE)
    if len(sources) == 1:
        RobotView(0, sources[0], read_only)
        return
    with ui.tabs().classes("w-full").props("no-caps") as tabs:
        for index, source in enumerate(sources):
            ui.tab(str(index), label=source.name)
    with ui.tab_panels(tabs, value="0", keep_alive=True).classes("w-full p-0"):
        for index, source in enumerate(sources):
            with ui.tab_panel(str(index)).classes("p-0"):
                RobotView(index, source, read_only)


class RobotView:
    """Everything about one robot."""

    def __init__(self, index: int, source: Source, read_only: bool) -> None:
        """Build the cards into the present container."""
        self._index, self._source = index, source
        self._refreshed = 0
        self._header()
        self._panels: list[FilterPanel | DiagnosticsPanel | PlaybackPanel | ActionPanel] = []
        with ui.element("div").classes("grid w-full gap-2 grid-cols-1 lg:grid-cols-3"):
            with ui.card().classes("w-full"):
                scene, body, ghost, wheels = self._scene(source.geometry())
                actions = ActionPanel(source, read_only) if source.live else None
                self._panels.append(actions or PlaybackPanel(source))
            with ui.card().classes("w-full lg:col-span-2"):
                tilt, error = self._charts()
            with ui.card().classes("w-full"):
                self._panels.append(FilterPanel(source, read_only))
            if source.live:
                with ui.card().classes("w-full"):
                    ParameterPanel(source, read_only)
                with ui.card().classes("w-full"):
                    self._panels.append(DiagnosticsPanel(source))
        ids = {
            "scene": scene.id,
            "body": body,
            "ghost": ghost,
            "wheels": wheels,
            "tilt": tilt.id,
            "error": error.id,
            "pad": actions.pad if actions else None,
            "late": self._late.id if source.live else None,
            "onRequest": list(source.on_request),
        }
        ui.timer(REFRESH, self._refresh)
        client = ui.context.client

        async def begin() -> None:
            await client.connected()
            client.run_javascript(f"twbr.start({index}, {json.dumps(ids)})")

        background_tasks.create(begin(), name="start of the pictures")

    def _header(self) -> None:
        with ui.row().classes("twbr-header w-full items-center gap-x-4 gap-y-0"):
            ui.label(self._source.name).classes("text-h6")
            self._chip = ui.badge("").classes("text-body1 twbr-state").props("data-mark=state")
            self._tilt = ui.label("").props("data-mark=tilt")
            self._late = ui.label("").classes("text-orange-9 text-bold").props("data-mark=late")

    def _refresh(self) -> None:
        self._tilt.set_text(_in_numbers(self._source.telemetry.pose))
        words, level = self._source.words()
        self._chip.set_text(words)
        self._chip.props(f"color={COLORS.get(level, 'grey')}")
        self._refreshed += 1
        if self._refreshed % 2:
            for panel in self._panels:
                panel.refresh()

    def _charts(self) -> tuple[ui.echart, ui.echart]:
        with ui.row().classes("w-full items-center no-wrap gap-2"):
            ui.label("Tilt [deg], time [s]").classes("text-subtitle1")
            ui.space()
            ui.switch("pause", on_change=lambda event: self._run("pause", bool(event.value)))
            ui.button("whole", on_click=lambda: self._run("zoomOut")).props("flat dense")
        tilt = ui.echart(_chart()).classes("w-full h-72")
        ui.label("Error of the active filter and its own 2-sigma band [deg]")
        error = ui.echart(_chart(legend=False)).classes("w-full h-48")
        return tilt, error

    def _run(self, method: str, *arguments: bool) -> None:
        values = [str(self._index), *(str(value).lower() for value in arguments)]
        ui.run_javascript(f"twbr.{method}({', '.join(values)})")

    def _scene(self, size: ShownRobot) -> tuple[ui.scene, str, str, str]:
        """Draw the robot; forward is +x, and the camera stands to its right."""
        radius, width, height = size.wheel_radius, size.track_width, size.body_height
        scale = 1.0 / (height + 2.0 * radius)
        radius, width, height = scale * radius, scale * width, scale * height
        with ui.scene(height=SCENE_HEIGHT, grid=(4, 20), background_color="#f5f5f5") as scene:
            scene.classes("w-full").style(f"height: {SCENE_HEIGHT}px")
            scene.move_camera(x=0.35, y=-1.25, z=0.75, look_at_z=0.45, duration=0.0)
            parts = []
            for color, opacity in ((None, 1.0), (GHOST, 0.35)):
                with scene.group().move(z=radius) as group:
                    box = scene.box(0.35 * height, 0.8 * width, height).move(z=0.5 * height)
                    box.material(color or "#1976d2", opacity)
                parts.append(group.id)
            with scene.group().move(z=radius) as wheels:
                for side in (-0.5, 0.5):
                    with scene.group().move(y=side * width):
                        disc = scene.cylinder(radius, radius, 0.15 * width, radial_segments=32)
                        disc.material("#424242")
                        spoke = scene.box(1.8 * radius, 0.17 * width, 0.2 * radius)
                        spoke.material("#ffc107")
                        spoke.rotate(0.0, 0.0, 0.0)
                        disc.rotate(0.0, 0.0, math.pi)
        return scene, parts[0], parts[1], wheels.id


def _in_numbers(pose: Pose) -> str:
    """Return the tilt as a number, and that of the reference where there is one."""
    found = [("tilt", pose.tilt), ("reference", pose.reference)]
    return ", ".join(
        f"{name} {round(value * DEGREES, 1) + 0.0:.1f} deg ({round(value, 3) + 0.0:.3f} rad)"
        for name, value in found
        if math.isfinite(value)
    )


def _chart(legend: bool = True) -> dict[str, object]:
    return {
        "animation": False,
        "grid": {"left": 48, "right": 12, "top": 32 if legend else 8, "bottom": 28},
        "legend": {"show": legend, "type": "scroll", "top": 0},
        "color": OTHERS,
        "tooltip": {"trigger": "axis", "confine": True, "show": False},
        "xAxis": {
            "type": "value",
            "min": 0,
            "max": 30,
            "axisLabel": {"showMinLabel": False, "showMaxLabel": False},
        },
        "yAxis": {"type": "value", "scale": True},
        "dataZoom": [
            {"type": "inside", "filterMode": "none"},
            {"type": "inside", "yAxisIndex": 0, "filterMode": "none", "zoomOnMouseWheel": "shift"},
        ],
        "series": [],
    }
