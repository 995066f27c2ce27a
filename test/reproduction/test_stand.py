"""Chudzik 2021, Figs 6 to 10."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from twbr_estimation.cli.main import main
from twbr_estimation.filters import filter_named
from twbr_estimation.reproduction import Plan
from twbr_estimation.reproduction.stand import DETUNING, FILTERS, SCENES, detuned, rows_of

DOCUMENT = Path(__file__).resolve().parent.parent.parent / "docs" / "reproduction.json"


@pytest.fixture(scope="module")
def figures() -> dict[str, Any]:
    read: dict[str, Any] = json.loads(DOCUMENT.read_text())["stand"]
    return read


@pytest.mark.parametrize("scene", SCENES)
def test_the_document_is_what_the_code_computes(figures: dict[str, Any], scene: str) -> None:
    rows = [row for row in figures["rows"] if row["scene"] == scene]
    found = rows_of(scene, Plan(), figures["parameters"])
    for row, again in zip(rows, found, strict=True):
        assert again.keys() == row.keys()
        for name, value in row.items():
            expected = value if isinstance(value, str) else pytest.approx(value, rel=1e-6, abs=1e-9)
            assert again[name] == expected


def test_tuned_filters_keep_the_degree_that_the_paper_asks_for(figures: dict[str, Any]) -> None:
    limit = figures["printed"]["uncertainty_deg"]
    worst = {
        setting: max(r["rmse_deg"] for r in figures["rows"] if r["setting"] == setting)
        for setting in DETUNING
    }
    assert worst["tuned"] < 0.5 * limit
    assert worst["too fast"] > limit and worst["too slow"] > limit


@pytest.mark.parametrize("name", FILTERS)
def test_detuning_stretches_the_time_a_filter_takes_to_forget(
    figures: dict[str, Any], name: str
) -> None:
    """For the Kalman filter by its steady gain, with a bias that it hardly learns."""
    values = {**figures["parameters"][name]}
    if name == "complementary":
        assert detuned(name, values, 10.0)["time_constant"] == 10.0 * values["time_constant"]
        return
    entry = filter_named(name)
    values["q2"] = 1e-16

    def gain(factor: float) -> float:
        parameters = entry.configure(detuned(name, values, factor))
        return float(entry.matrices(parameters, 0.01)[3][0, 0])

    assert gain(1.0) / gain(10.0) == pytest.approx(10.0, rel=0.1)


def test_what_is_not_drawn_has_no_picture(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "fig9", "--plot", "nowhere.png"]) == 1
    assert "nothing to draw; there are: fig12, stand" in capsys.readouterr().err


def test_the_picture_shows_five_figures(tmp_path: Path, figures: dict[str, Any]) -> None:
    from twbr_estimation.reproduction.stand import draw

    picture = tmp_path / "stand.png"
    draw(picture, Plan(duration=15.0), figures["parameters"])
    assert picture.read_bytes().startswith(b"\x89PNG")
