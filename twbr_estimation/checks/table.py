"""Findings as a table of 80 columns and as plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .finding import Finding, Severity

_COLOURS = {
    Severity.PASS: "green",
    Severity.SKIP: "dim",
    Severity.WARN: "yellow",
    Severity.FAIL: "bold red",
}


def table(title: str, findings: Sequence[Finding]) -> Table:
    """Return findings as rows, in their order."""
    rows = Table(title=escape(title), title_justify="left", show_lines=False)
    rows.add_column("result", no_wrap=True)
    rows.add_column("of", no_wrap=True)
    rows.add_column("finding", ratio=1)
    for each in findings:
        name = f"[{_COLOURS[each.severity]}]{each.severity.name}[/]"
        rows.add_row(name, escape(each.subject), escape(each.text))
    return rows


def print_findings(console: Console, title: str, findings: Sequence[Finding]) -> None:
    """Print the table, how many there are of each severity, and the lines to change."""
    console.print(table(title, findings))
    counts = {level: sum(each.severity is level for each in findings) for level in Severity}
    console.print(", ".join(f"{count} {level.name}" for level, count in counts.items() if count))
    if lines := yaml_lines(findings):
        console.print("change:", *(f"  {escape(line)}" for line in lines), sep="\n")


def as_json(findings: Sequence[Finding]) -> list[dict[str, Any]]:
    """Return findings as plain data."""
    return [
        {
            "severity": each.severity.name,
            "subject": each.subject,
            "check": each.check,
            "text": each.text,
            "ratio": _finite(each.ratio),
            "parameter": each.parameter,
            "value": list(each.value) if isinstance(each.value, tuple) else each.value,
        }
        for each in findings
    ]


def from_json(findings: Sequence[Mapping[str, Any]]) -> list[Finding]:
    """Return the findings of `as_json`; a list of numbers stays one where it was a tuple."""
    return [Finding(**{**each, "severity": Severity[each["severity"]]}) for each in findings]


def _finite(ratio: float | None) -> float | None:
    return ratio if ratio is not None and math.isfinite(ratio) else None


def yaml_lines(findings: Sequence[Finding]) -> list[str]:
    """Return the lines of a parameter file that mend what was found."""
    lines = []
    for each in findings:
        if each.severity >= Severity.WARN and each.parameter and each.value is not None:
            lines.append(f"{each.parameter}: {_shown(each.value)}")
    return list(dict.fromkeys(lines))


def _shown(value: object) -> str:
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(_shown(each) for each in value) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.4g}" if isinstance(value, float) else str(value)
