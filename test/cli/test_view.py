from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from twbr_estimation.cli.main import main
from twbr_estimation.cli.view import FEW
from twbr_estimation.configuration.filter_settings import DEFAULT_FILTER

BAG = str(Path(__file__).resolve().parents[2] / "bags" / "verification")


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What the page would be served with."""
    found: list[Any] = []
    target = "twbr_estimation.dashboard.server.serve"
    monkeypatch.setattr(target, lambda sources, settings, started: found.extend(sources))
    return found


def names_of(source: Any) -> set[str]:
    source.seek(0.5)
    return set(source.telemetry.frame()["traces"])


def test_a_few_filters_run_where_none_is_named(served: list[Any]) -> None:
    assert main(["view", BAG]) == 0
    (source,) = served
    assert source.active == FEW[0]
    assert names_of(source) == {"reference", "active", *FEW[1:]}
    source.seek(1.5)
    deviations = [deviation for _, _, deviation in source.telemetry.frame()["errors"]]
    assert len(deviations) > 50 and min(deviations) > 0.0, "its own, for the 2-sigma band"


def test_the_first_filter_named_is_the_active_one(
    served: list[Any], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", BAG, "--filter", "gyro", "--filter", "complementary"]) == 0
    (source,) = served
    assert source.active == "gyro"
    assert names_of(source) == {"reference", "active", "complementary"}
    assert "running gyro, complementary" in capsys.readouterr().err


def test_of_all_filters_the_default_one_is_active(
    served: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    names: list[str] = []

    def run(request: Any, *_: Any, **__: Any) -> Any:
        names.extend(request.names)
        return request

    monkeypatch.setattr("twbr_estimation.drives.request.RunRequest.runs", run)
    monkeypatch.setattr("twbr_estimation.dashboard.recorded.RecordedSource", lambda *_: None)
    assert main(["view", BAG, "--filter", "all"]) == 0
    assert names[0] == DEFAULT_FILTER
    assert len(names) == len(set(names)) > 10
