"""The figures of a score: names, headings and forms, for tables, pages and topics alike."""

from __future__ import annotations

from typing import NamedTuple


class Figure(NamedTuple):
    """One figure of a `Score` and how it is shown."""

    name: str
    """Field of `Score`; its end is the unit."""
    title: str
    unit: str
    """Unit in which it is shown."""
    form: str
    factor: float = 1.0
    """From the field to what is shown."""

    def text(self, value: float) -> str:
        """Return a value as it is shown."""
        return self.form.format(value * self.factor)


FIGURES = (
    Figure("mse_deg2", "MSE", "deg²", "{:.4f}"),
    Figure("rmse_deg", "RMSE", "deg", "{:.4f}"),
    Figure("bias_deg", "bias", "deg", "{:+.4f}"),
    Figure("max_abs_deg", "max", "deg", "{:.3f}"),
    Figure("delay_s", "delay", "ms", "{:+.2f}", 1e3),
)
