"""What a check found: how serious, about which data, in words, and what to change."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum


class Severity(IntEnum):
    """How serious a finding is; larger is worse."""

    PASS = 0
    """As it should be."""
    SKIP = 1
    """The data do not decide it; the text gives the reason."""
    WARN = 2
    """Figures become worse, or cannot be trusted in part."""
    FAIL = 3
    """The data contradict each other, physics or the robot's description."""


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one check."""

    severity: Severity
    subject: str
    """Stream or part of the configuration: `accelerometer`, `wheels`, `robot`."""
    check: str
    """What was checked: `unit`, `sign`, `clock`."""
    text: str
    """A sentence with what was found, its limit and what to do."""
    ratio: float | None = None
    """Found value over expected value, where the check measures one."""
    parameter: str | None = None
    """Full name of the parameter to change, as in `robot.wheel_radius`."""
    value: object = None
    """Suggested value of that parameter."""

    @property
    def sentence(self) -> str:
        """Return the finding as a warning: subject and text."""
        return f"{self.subject}: {self.text}"


def passed(subject: str, check: str, text: str, ratio: float | None = None) -> Finding:
    """Return a finding that all is well."""
    return Finding(Severity.PASS, subject, check, text, ratio)


def noteworthy(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return the warnings and failures, the worst first."""
    found = [each for each in findings if each.severity >= Severity.WARN]
    return tuple(sorted(found, key=lambda each: -each.severity))


def worst(findings: Iterable[Finding]) -> Severity:
    """Return the highest severity; PASS where there are no findings."""
    return max((each.severity for each in findings), default=Severity.PASS)


def sentences(findings: Iterable[Finding]) -> str:
    """Return findings as one text."""
    return "; ".join(each.sentence for each in findings)
