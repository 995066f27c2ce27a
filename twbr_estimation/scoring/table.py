"""Scores as a table on the terminal and as a JSON file."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ..disk.writing import write_text
from ..printing.console import SafeConsole
from ..printing.text import counted
from .figure_table import FIGURES
from .score import SMOOTHED, RecordingScore, as_json, mean_over


def print_scores(console: Console, scores: Sequence[RecordingScore]) -> None:
    """Print what was found in each recording and its table, the means, and all warnings in full."""
    for entry in scores:
        _print_recording(console, entry)
    if len(scores) > 1:
        console.print(_table(f"mean over {len(scores)} recordings", mean_over(scores)))
    for warning in dict.fromkeys(text for entry in scores for text in entry.warnings):
        console.print(f"warning: {escape(warning)}", highlight=False, soft_wrap=True)


EACH_UP_TO = 20
"""Recordings that are printed one by one."""
WARNINGS_UP_TO = 20


def print_many_scores(console: Console, scores: Sequence[RecordingScore]) -> None:
    """Do what `print_scores` does; of more than a few recordings, print the means only."""
    if len(scores) <= EACH_UP_TO:
        print_scores(console, scores)
        return
    _print_counts(console, scores)
    console.print(_table(f"mean over {len(scores)} recordings", mean_over(scores)))
    warnings = list(dict.fromkeys(text for entry in scores for text in entry.warnings))
    for warning in warnings[:WARNINGS_UP_TO]:
        console.print(f"warning: {escape(warning)}", highlight=False, soft_wrap=True)
    if len(warnings) > WARNINGS_UP_TO:
        console.print(f"{len(warnings) - WARNINGS_UP_TO} more warnings are in the JSON")


def as_text(scores: Sequence[RecordingScore], width: int = 100) -> str:
    """Return what `print_scores` prints, in so many columns at most, without colours."""
    console = SafeConsole(file=StringIO(), width=width, color_system=None)
    with console.capture() as captured:
        print_scores(console, scores)
    return captured.get().rstrip("\n")


def write_scores(target: str, scores: Sequence[RecordingScore]) -> None:
    """Write the JSON of `evaluation.as_json` to a file, or to stdout where `target` is `-`.

    Raises:
        WritingError: the file cannot be written.
    """
    write_json(target, as_json(scores))


def write_json(target: str, document: Mapping[str, object]) -> None:
    """Write a document to a file, or to stdout where `target` is `-`.

    Raises:
        WritingError: the file cannot be written.
    """
    text = json.dumps(document, indent=2, allow_nan=False)
    if target == "-":
        sys.stdout.write(text + "\n")
        return
    write_text(Path(target), text + "\n")


BRIEF = 96
"""Columns of a finding in front of a table."""


def _print_brief(console: Console, entry: RecordingScore) -> None:
    """Print in short what puts the figures that follow in doubt."""
    texts = [_brief(each) for each in entry.findings]
    if texts:
        title = f"{entry.source}: the data have {counted(len(texts), 'finding')}; in full below"
        console.print(escape(title), highlight=False, soft_wrap=True)
    for text in texts:
        console.print(f"  {escape(text)}", highlight=False, soft_wrap=True)


def _brief(finding: Mapping[str, Any]) -> str:
    """Return severity, subject and the first statement of a finding."""
    text = f"{finding['severity']} {finding['subject']}: {finding['text'].split('; ')[0]}"
    return text if len(text) <= BRIEF else f"{text[: BRIEF - 3].rsplit(' ', 1)[0]}..."


def _print_counts(console: Console, scores: Sequence[RecordingScore]) -> None:
    """Print in how many recordings each check found something."""
    found = Counter(
        kind
        for entry in scores
        for kind in {(f["severity"], f["subject"], f["check"]) for f in entry.findings}
    )
    for (severity, subject, check), count in sorted(found.items(), key=lambda each: -each[1]):
        text = f"{severity} {subject}, {check}: in {count} of {counted(len(scores), 'recording')}"
        console.print(escape(text), highlight=False, soft_wrap=True)


def _print_recording(console: Console, entry: RecordingScore) -> None:
    _print_brief(console, entry)
    title = f"{entry.source}: {counted(entry.samples, 'sample')} at {entry.dt * 1e3:g} ms"
    figures = {
        name: {each.name: getattr(score, each.name) for each in FIGURES}
        for name, score in entry.estimators.items()
    }
    console.print(_table(title, figures))
    left_out = max((score.left_out for score in entry.estimators.values()), default=0)
    if left_out:
        console.print(f"  {counted(left_out, 'sample')} without a reference left out")
    stated = entry.smoothed_deviation_deg
    if stated is not None and entry.reference == SMOOTHED:
        console.print(
            f"  reference: smoothed from the recording itself, +-{stated:.3f} deg",
            soft_wrap=True,
        )
    elif stated is not None:
        console.print(f"  smoothed: computed from the whole recording; stated +-{stated:.3f} deg")
    for repair, count in entry.repairs.items():
        console.print(f"  repaired: {escape(repair)}: {count}", soft_wrap=True)


def _table(title: str, figures: Mapping[str, Mapping[str, float]]) -> Table:
    table = Table(title=escape(title), title_justify="left")
    table.add_column("estimator", no_wrap=True)
    for figure in FIGURES:
        heading = escape(f"{figure.title}\n[{figure.unit}]")
        table.add_column(heading, justify="right", no_wrap=True)
    for name, values in sorted(figures.items(), key=lambda item: item[1]["mse_deg2"]):
        cells = [figure.text(values[figure.name]) for figure in FIGURES]
        table.add_row(escape(name), *cells)
    return table
