from __future__ import annotations

import pytest

from twbr_estimation.configuration.filter_settings import Settings
from twbr_estimation.filters import filter_named

TUNED = Settings({"complementary": {"time_constant": 0.3}}, dt=0.002, source="mine.yaml")


@pytest.mark.parametrize(("dt", "warns"), [(0.002, False), (0.0021, False), (0.00189, True)])
def test_more_than_five_percent_from_the_tuned_period_warns(dt: float, warns: bool) -> None:
    assert bool(TUNED.warnings(dt)) == warns


def test_the_warning_names_source_and_both_periods() -> None:
    assert TUNED.warnings(0.01) == ("mine.yaml: tuned at 0.002 s, used at 0.01 s",)


def test_unknown_periods_say_nothing() -> None:
    assert Settings({"complementary": {"time_constant": 0.3}}).warnings(0.01) == ()
    assert TUNED.warnings(0.0) == ()


def test_untouched_defaults_warn_by_their_own_period() -> None:
    entries = [filter_named("complementary"), filter_named("alpha_beta_wb")]
    assert Settings().warnings(0.01, entries) == (
        "defaults of alpha_beta_wb: tuned at 0.002 s, used at 0.01 s",
    )
    assert Settings().warnings(0.002, entries) == ()
