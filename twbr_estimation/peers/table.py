"""Comparisons as a table: mean square errors by recording, and the cost of a sample."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .comparison import Comparison

COST = "us a sample"


def names_of(comparisons: Sequence[Comparison]) -> list[str]:
    """Return all estimators in the order in which they came."""
    return list(dict.fromkeys(name for each in comparisons for name in each.score.estimators))


def errors_by_group(
    groups: Mapping[str, Sequence[Comparison]],
) -> dict[str, dict[str, float]]:
    """Return the mean over each group of the mean square error by estimator [deg^2]."""
    found: dict[str, dict[str, float]] = {}
    for group, comparisons in groups.items():
        found[group] = {
            name: float(
                np.mean(
                    [
                        each.score.estimators[name].mse_deg2
                        for each in comparisons
                        if name in each.score.estimators
                    ]
                )
            )
            for name in names_of(comparisons)
        }
    return found


def cost(comparisons: Sequence[Comparison]) -> dict[str, float]:
    """Return the median over recordings of the CPU time for one sample, by estimator [us]."""
    return {
        name: float(
            np.median(
                [each.microseconds[name] for each in comparisons if name in each.microseconds]
            )
        )
        for name in dict.fromkeys(name for each in comparisons for name in each.microseconds)
    }


def markdown(groups: Mapping[str, Sequence[Comparison]]) -> str:
    """Return the table for a page: one row a group, the smallest error of a row in bold."""
    everything = [each for comparisons in groups.values() for each in comparisons]
    names = names_of(everything)
    lines = [f"| | {' | '.join(names)} |", f"|{'---|' * (len(names) + 1)}"]
    for group, errors in errors_by_group(groups).items():
        best = min(errors.values())
        cells = [
            ("**{:.3g}**" if errors[name] == best else "{:.3g}").format(errors[name])
            if name in errors
            else ""
            for name in names
        ]
        lines.append(f"| {group} | {' | '.join(cells)} |")
    times = cost(everything)
    cells = [f"{times[name]:.2g}" if name in times else "" for name in names]
    lines.append(f"| {COST} | {' | '.join(cells)} |")
    return "\n".join(lines)
