"""A report as one HTML file that needs nothing else, not even a network."""

from __future__ import annotations

import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from enum import Enum
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..drives import Runs
from ..errors import ConfigurationError
from ..filters import filter_named
from ..printing.text import counted
from ..scoring.figure_table import FIGURES
from ..scoring.score import ScoringOptions, mean_over
from .data import RAW, RecordingReport
from .plots import LineValues, histogram_plot, spectrum_plot, time_plots
from .traces import REFERENCE, Trace

POINTS = 12_000
"""Points of a line when there is one recording; several share them."""
FEWEST_POINTS = 3_000
FOLDER = Path(__file__).parent
TEMPLATE = "page.html"
SCRIPTS = ("bokeh.min.js", "bokeh-api.min.js")
"""Of BokehJS; the second makes plots without Python's classes."""
_PACKAGES = ("numpy", "scipy", "numba", "bokeh")
_YEAR_2000 = 946_684_800_000_000_000


@dataclass(frozen=True, slots=True)
class TableRow:
    """One estimator in a table."""

    name: str
    colour: str
    dash: str
    visible: bool
    cells: tuple[str, ...]


def render(
    reports: Sequence[RecordingReport],
    traces: Sequence[Sequence[Trace]],
    command: str,
    options: ScoringOptions,
) -> str:
    """Return the page.

    Args:
        reports: one for each recording, at least one.
        traces: the lines of each.
        command: the command line that made it.
        options: how estimates were compared with the reference.

    Raises:
        ConfigurationError: Bokeh or Jinja is missing.
    """
    library = bokeh_scripts()
    points = max(FEWEST_POINTS, POINTS // len(reports))
    values = LineValues()
    sections = [
        _section(report, f"r{index}", lines, points, values)
        for index, (report, lines) in enumerate(zip(reports, traces, strict=True))
    ]
    plots = {
        f"{section['id']}-{kind}": plot
        for section in sections
        for kind, plot in section["plots"].items()
    }
    text: str = _template().render(
        sections=sections,
        data={"values": values.encoded(), "plots": plots},
        library=library,
        drawing=(FOLDER / "plots.js").read_text(),
        headings=[f"{each.title} [{each.unit}]" for each in FIGURES],
        mean=_mean_rows(reports),
        command=command,
        versions=versions(),
        comparison=_comparison(options),
        made=datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
    )
    return text


def _template() -> Any:
    try:
        from jinja2 import Environment, FileSystemLoader, StrictUndefined
    except ImportError as error:
        raise missing("jinja2") from error
    loader = FileSystemLoader(FOLDER)
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":")}  # in the given order
    return environment.get_template(TEMPLATE)


def bokeh_scripts() -> list[str]:
    """Return the scripts that draw plots, as the installed package has them for browsers.

    Raises:
        ConfigurationError: Bokeh is missing.
    """
    found = find_spec("bokeh")
    if found is None or found.origin is None:
        raise missing("bokeh")
    folder = Path(found.origin).parent / "server" / "static" / "js"
    return [(folder / name).read_text(encoding="utf-8") for name in SCRIPTS]


def missing(package: str) -> ConfigurationError:
    """Return the error of a package that a report needs."""
    return ConfigurationError(f"a report needs {package}: pip install 'twbr_estimation[report]'")


def versions() -> dict[str, str]:
    """Return the versions of all that had a part in the figures."""
    found = {"twbr_estimation": __version__, "Python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return {**found, "machine": f"{platform.system()} {platform.machine()}"}


def _section(
    report: RecordingReport,
    identifier: str,
    traces: Sequence[Trace],
    points: int,
    values: LineValues,
) -> dict[str, Any]:
    plots = time_plots(traces, points, identifier, values)
    if any(trace.error.size for trace in traces):
        plots["histogram"] = histogram_plot(traces, identifier, values)
    if report.motion is not None:
        plots["spectrum"] = spectrum_plot(report.motion, traces, identifier, values)
    return {
        "id": identifier,
        "source": report.runs.recording.source,
        "facts": dict(_facts(report)),
        "quality": report.quality,
        "repairs": report.runs.recording.repairs,
        "warnings": report.runs.warnings,
        "rows": _rows(report, traces),
        "scored": report.runs.score is not None,
        "plots": plots,
        "motion": report.motion,
        "no_motion": report.no_motion,
        "effects": report.effects,
        "speaking": report.runs.drive.settings.filter,
        "settings": _settings(report.runs),
    }


def _facts(report: RecordingReport) -> Iterator[tuple[str, str]]:
    recording = report.runs.recording
    yield "duration", f"{recording.duration:.1f} s"
    first = int(recording.imu.stamps[0])
    if first > _YEAR_2000:  # simulated time starts at 0
        started = datetime.fromtimestamp(first * 1e-9, timezone.utc)
        yield "recorded", started.strftime("%Y-%m-%d %H:%M:%S UTC")
    yield "IMU", f"{counted(recording.imu.stamps.size, 'sample')} every {1e3 * recording.dt:.4g} ms"
    wheels = recording.wheels
    encoders = 0 if wheels is None else wheels.angle.shape[1]
    yield "wheel encoders", str(encoders) if encoders else "none"
    for name, time in report.runs.wheels_ignored.items():
        yield "wheels ignored", f"{time:.1f} s by {name}"
    yield "reference", report.reference
    if recording.reference is not None:
        yield "rms tilt", f"{np.degrees(np.std(recording.reference.tilt)):.2f} deg"
    if recording.temperature is not None:
        values = recording.temperature.temperature
        yield "temperature", f"{values.min():.1f} to {values.max():.1f} °C"


def _rows(report: RecordingReport, traces: Sequence[Trace]) -> list[TableRow]:
    """Return reference and estimators, the best first, then the raw angle."""
    by_name = {trace.name: trace for trace in traces}
    score = report.runs.score
    rows = []
    for name in (REFERENCE, *report.ranked, RAW):
        if name not in by_name:
            continue
        trace = by_name[name]
        figures = None if score is None else score.estimators.get(name)
        cells = tuple(
            "" if figures is None else each.text(getattr(figures, each.name)) for each in FIGURES
        )
        rows.append(TableRow(name, trace.colour, trace.dash, trace.visible, cells))
    return rows


def _mean_rows(reports: Sequence[RecordingReport]) -> list[tuple[str, tuple[str, ...]]]:
    """Return the mean over several recordings, the best first; nothing for a single one."""
    scores = [report.runs.score for report in reports if report.runs.score is not None]
    if len(reports) < 2 or len(scores) < len(reports):
        return []
    means = sorted(mean_over(scores).items(), key=lambda item: item[1]["mse_deg2"])
    return [
        (name, tuple(each.text(values[each.name]) for each in FIGURES)) for name, values in means
    ]


def _comparison(options: ScoringOptions) -> str:
    parts = []
    if options.reference_delay:
        parts.append(f"reference {1e3 * options.reference_delay:g} ms later")
    if options.reference_offset:
        parts.append(f"reference {np.degrees(options.reference_offset):+g} deg")
    if options.skip:
        parts.append(f"first {options.skip:g} s not scored")
    return "; ".join(parts)


def _settings(done: Runs) -> Mapping[str, Mapping[str, str]]:
    """Return every setting in force by section."""
    found = {
        "robot": asdict(done.drive.setup.robot),
        "calibration": asdict(done.drive.setup.calibration),
        "correction": asdict(done.drive.setup.correction),
    }
    for name, values in done.parameters.items():
        found[f"filter {name}"] = filter_named(name).configure(values)._asdict()
    return {
        section: {key: _shown(value) for key, value in values.items()}
        for section, values in found.items()
        if values
    }


def _shown(value: object) -> str:
    if isinstance(value, Enum):
        return str(value.value)
    if isinstance(value, (tuple, list)):
        return ", ".join(_shown(entry) for entry in value) or "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
