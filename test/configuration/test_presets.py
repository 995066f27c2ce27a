from __future__ import annotations

from pathlib import Path

import pytest

from twbr_estimation.configuration import presets as module
from twbr_estimation.configuration.files import write_settings
from twbr_estimation.configuration.filter_settings import Settings
from twbr_estimation.configuration.presets import preset, presets
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.robot import CorrectionSettings


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for period in (0.002, 0.01):
        settings = Settings({"complementary": {"time_constant": 100 * period}}, dt=period)
        path = tmp_path / "mine" / f"{1000 * period:.0f}ms.yaml"
        write_settings(path, settings, CorrectionSettings(dt=period))
    monkeypatch.setattr(module, "_FOLDER", tmp_path)
    return tmp_path


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(("dt", "row"), [(0.001, 0.002), (0.004, 0.002), (0.005, 0.01), (1, 0.01)])
def test_the_row_with_the_nearest_ratio_is_taken(dt: float, row: float) -> None:
    correction, settings = preset("mine", dt)
    assert correction == CorrectionSettings(dt=row)
    assert settings.dt == row
    assert settings.values == {"complementary": {"time_constant": 100 * row}}
    assert settings.warnings(dt)


def test_a_preset_may_leave_the_correction_alone(folder: Path) -> None:
    write_settings(folder / "other" / "any.yaml", Settings(dt=0.005))
    correction, settings = preset("other", 0.005)
    assert correction is None
    assert settings.warnings(0.005) == ()


@pytest.mark.usefixtures("folder")
def test_unknown_names_and_periods_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="no preset 'table9'; there are: mine"):
        preset("table9", 0.002)
    with pytest.raises(ConfigurationError, match=r"sampling period 0\.0 s is not above 0"):
        preset("mine", 0.0)


@pytest.mark.parametrize("name", presets())
def test_every_shipped_file_can_be_read_and_has_its_period(name: str) -> None:
    for path in Path(module.__file__).parent.glob(f"{name}/*.yaml"):
        settings = module.read_settings(path)
        assert settings.dt > 0.0, path
        assert settings.values, path
