"""`report` on many recordings: a page for each in a folder of its own, and one that lists them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ..disk.writing import write_text
from ..drives import Runs
from ..drives.request import RunRequest
from ..report.data import RecordingReport, collect
from ..report.page import render
from ..report.pictures import tilt_picture
from ..report.traces import traces_of
from .digests import digest_of_folder
from .jobs import Job
from .series import Failure

PAGE, PICTURE = "report.html", "tilt.png"


@dataclass(frozen=True, slots=True)
class Reporting(Job):
    """Writes the page of each recording; the folder must be one that all workers see."""

    request: RunRequest
    folder: Path
    """Absolute path of the folder of the whole report."""
    command: str
    """Command line that made it, for the pages."""
    verb: str = "report"

    def settings(self, part: str) -> str:
        """Return what shapes a page."""
        return repr((part, self.request, digest_of_folder(self.request.config), str(self.folder)))

    def is_there(self, result: Mapping[str, Any]) -> bool:
        """Return whether the page is still there."""
        return bool((self.folder / result["page"]).exists())

    def open(self, place: str, path: Path) -> tuple[str, Runs]:
        """Read a recording and run the filters.

        Raises:
            TwbrError: it cannot be used.
        """
        return place, self.request.runs(path, reference=False)

    def run(self, opened: tuple[str, Runs], part: str) -> Mapping[str, Any]:
        """Write page and picture.

        Raises:
            TwbrError: a package is missing, or they cannot be written.
        """
        place, runs = opened
        name = folder_of(place)
        report = collect(runs)
        target = self.folder / name
        (traces,) = traces_of([report])
        page = render([report], [traces], self.command, self.request.options)
        write_text(target / PAGE, page)
        tilt_picture(traces, title_of(report), target / PICTURE)
        score = runs.score
        figures = {} if score is None else score.estimators
        return {
            "page": f"{name}/{PAGE}",
            "duration_s": runs.recording.duration,
            "reference": report.reference,
            "mse_deg2": {each: figures[each].mse_deg2 for each in report.ranked if each in figures},
        }


def title_of(report: RecordingReport) -> str:
    """Return the title of a picture; a smoothed reference must not look like an encoder."""
    source = report.runs.recording.source
    smoothed = report.reference.startswith("smoothed")
    return f"{source}; reference: {report.reference}" if smoothed else source


def folder_of(place: str) -> str:
    """Return the name of a recording's folder: like its own, and of no other place."""
    digest = hashlib.sha256(place.encode("utf-8", "surrogateescape")).hexdigest()[:6]
    name = place.rstrip("/").rpartition("/")[2]
    plain = "".join(each if each.isalnum() or each in "-_." else "_" for each in name)
    return f"{plain.lstrip('.')[:80]}-{digest}"


def index_page(
    results: Mapping[str, Mapping[str, Any]], failures: Sequence[Failure], command: str
) -> str:
    """Return a page that lists the pages of all recordings, the best estimator of each, failures.

    Args:
        results: of `Reporting`, by place.
        failures: recordings without a page.
        command: command line that made it.
    """
    rows = []
    for place, result in results.items():
        best = next(iter(result["mse_deg2"].items()), None)
        figures = ("", "") if best is None else (best[0], f"{best[1]:.4f}")
        link = f'<a href="{quote(result["page"])}">{escape(place)}</a>'
        cells = (f"{result['duration_s']:.1f}", result["reference"], *figures)
        rows.append(f"<tr><td>{link}</td>{''.join(f'<td>{escape(each)}</td>' for each in cells)}")
    failed = "".join(f"<li>{escape(str(each))}</li>" for each in failures)
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>Report</title>'
        '<meta name="viewport" content="width=device-width">'
        "<style>body{font:16px sans-serif;margin:1em auto;max-width:70em;padding:0 1em}"
        "td,th{padding:.2em .8em .2em 0;text-align:left}</style>"
        f"<h1>{len(results)} recordings</h1><table><tr><th>recording<th>duration [s]"
        f"<th>reference<th>best estimator<th>MSE [deg²]\n{chr(10).join(rows)}</table>"
        f"{failed and f'<h2>Failed</h2><ul>{failed}</ul>'}<p><code>{escape(command)}</code>\n"
    )
