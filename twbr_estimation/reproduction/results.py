"""All experiments of the reproduction as one document of plain data."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..errors import ConfigurationError
from ..tuning.several import Report
from ..workers import Workers
from .causes import causes
from .drives import LARGEST_SEEDS, TRAINING_SEEDS, Plan
from .figures import noise_spectra, one_drive, scale_errors
from .spins import table3
from .stand import stand
from .tables import table1, table2

PARTS = ("table1", "table2", "fig9", "fig11", "fig12", "causes", "stand", "table3")
"""Parts that can be reproduced; `fig9` means Figs 9 and 10, `stand` Chudzik 2021, `table3`
Sihite 2018."""
DRAWN = ("fig12", "stand")
"""Parts that can be drawn."""


def reproduce(
    parts: Sequence[str],
    plan: Plan,
    workers: Workers,
    report: Report,
    pictures: Mapping[str, Path] | None = None,
) -> dict[str, Any]:
    """Do the experiments again.

    Args:
        parts: some of `PARTS`.
        plan: on which drives.
        workers: who tunes.
        report: called with what improves.
        pictures: files to draw into by part, one of `DRAWN`.

    Returns:
        The plan, and the figures by part, printed beside ours.

    Raises:
        ConfigurationError: fewer than one seed, or more than there are.
    """
    if not 1 <= plan.seeds <= LARGEST_SEEDS:
        raise ConfigurationError(f"seeds: {plan.seeds} is outside [1, {LARGEST_SEEDS}]")
    drawn = pictures or {}
    experiments: dict[str, Callable[[], Any]] = {
        "table1": lambda: table1(plan, report),
        "table2": lambda: table2(plan, workers, report),
        "fig9": lambda: scale_errors(plan),
        "fig11": lambda: noise_spectra(plan),
        "fig12": lambda: one_drive(plan, drawn.get("fig12")),
        "causes": lambda: causes(plan, workers, report),
        "stand": lambda: stand(plan, workers, report, drawn.get("stand")),
        "table3": lambda: table3(plan),
    }
    document: dict[str, Any] = {
        "world": plan.world.name,
        "duration": plan.duration,
        "reported_seeds": list(range(1, plan.seeds + 1)),
        "training_seeds": list(TRAINING_SEEDS),
    }
    for part in parts:
        document[part] = experiments[part]()
    return document
