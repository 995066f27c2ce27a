"""The reproduction: its page, its document, and that the document is what the code computes."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from twbr_estimation.cli.main import main
from twbr_estimation.filters import filter_named
from twbr_estimation.reproduction import PARTS
from twbr_estimation.reproduction.drives import LARGEST_SEEDS, TRAINING_SEEDS, Plan, raw_mse
from twbr_estimation.reproduction.page import markdown, tables
from twbr_estimation.reproduction.printed import PERIODS, ROWS
from twbr_estimation.reproduction.tables import printed_settings
from twbr_estimation.tuning.correction import corrected_mse
from twbr_estimation.tuning.filter import mean_square_error
from twbr_estimation.tuning.objective import TuningSet

DOCS = Path(__file__).resolve().parent.parent.parent / "docs"
AGAIN = "run: twbr reproduce all --json docs/reproduction.json --markdown docs/reproduction.md"
DT = 0.02
"""The cheapest period stands for all where figures are computed again."""


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    read: dict[str, Any] = json.loads((DOCS / "reproduction.json").read_text())
    return read


@pytest.fixture(scope="module")
def reported(document: dict[str, Any]) -> list[TuningSet]:
    return Plan(len(document["reported_seeds"])).reported(DT)


def test_the_page_is_that_of_the_document(document: dict[str, Any]) -> None:
    assert (DOCS / "reproduction.md").read_text() == markdown(document), AGAIN


def test_the_document_is_complete(document: dict[str, Any]) -> None:
    assert set(PARTS) <= set(document)
    assert [row["dt"] for row in document["table1"]] == list(PERIODS)
    rows = {(row["filter"], row["dt"]) for row in document["table2"]}
    assert rows == {(name, dt) for name in (*ROWS, "kalman") for dt in PERIODS}


def test_no_reported_drive_was_tuned_on(document: dict[str, Any]) -> None:
    assert not set(document["reported_seeds"]) & set(document["training_seeds"])
    assert min(TRAINING_SEEDS) > LARGEST_SEEDS


def test_table_1_is_what_the_code_computes(
    document: dict[str, Any], reported: list[TuningSet]
) -> None:
    (rig,) = (row["rig"] for row in document["table1"] if row["dt"] == DT)
    printed, _ = printed_settings(DT)
    assert raw_mse(reported) == pytest.approx(rig["before_deg2"], rel=1e-6), AGAIN
    after = corrected_mse(reported, printed)
    assert after == pytest.approx(rig["after_with_printed_deg2"], rel=1e-6), AGAIN


@pytest.mark.parametrize("name", [*ROWS, "kalman"])
def test_table_2_is_what_the_code_computes(
    document: dict[str, Any], reported: list[TuningSet], name: str
) -> None:
    (rig,) = (r["rig"] for r in document["table2"] if (r["filter"], r["dt"]) == (name, DT))
    values = printed_settings(DT)[1][name]
    figure = mean_square_error(filter_named(name), values, reported)
    assert figure == pytest.approx(rig["with_printed_deg2"], rel=1e-6), AGAIN


def test_verification_counts_the_reported_drives(document: dict[str, Any]) -> None:
    reported = Plan(len(document["reported_seeds"])).reported(DT)
    (constants,) = (row["rig"] for row in document["table1"] if row["dt"] == DT)
    settings = printed_settings(DT)[0]
    changed = {name: constants[name] for name in ("rate_time_constant", "velocity_time_constant")}
    corrected = [each.corrected_with(replace(settings, **changed)) for each in reported]
    (rig,) = (
        row["rig"]
        for row in document["table2"]
        if (row["filter"], row["dt"]) == ("alpha_beta_wb", DT)
    )
    figure = mean_square_error(filter_named("alpha_beta_wb"), rig["parameters"], corrected)
    assert figure == pytest.approx(rig["verification_deg2"], rel=1e-6), AGAIN


def test_the_command_prints_and_writes_a_part(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "fig12.png"
    assert main(["reproduce", "fig12", "--json", "-", "--plot", str(picture)]) == 0
    output = capsys.readouterr()
    written = json.loads(output.out)
    assert 0.0 < written["fig12"]["rig"]["mse_deg2"] < 60.0
    (table,) = tables(written)
    assert table.rows[0][0] == "`alpha_beta_wb`"
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["table1", "--seeds", "0"], r"seeds: 0 is outside [1, 100]"),
        (["table1", "--markdown", "page.md"], "the page needs all parts"),
    ],
)
def test_what_cannot_be_done_is_refused(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert main(["reproduce", *arguments]) == 1
    assert message in capsys.readouterr().err
