"""Arguments of the launch files that start the page."""

from __future__ import annotations

from twbr_estimation.nodes.dashboard_launch import PAGE_ARGUMENTS, page_parameters
from twbr_estimation.nodes.dashboard_node import DashboardParameters
from twbr_estimation.nodes.declarations import declarations_of, settings_from

GIVEN = {each.name: each.default for each in PAGE_ARGUMENTS}


def test_no_page_by_default() -> None:
    assert page_parameters(GIVEN) is None


def test_arguments_become_parameters_of_the_node() -> None:
    given = {
        **GIVEN,
        "dashboard": "true",
        "dashboard_host": "0.0.0.0",
        "dashboard_port": "9000",
        "dashboard_read_only": "true",
    }
    parameters = page_parameters(given)
    assert parameters is not None
    declared = {each.name: each.default for each in declarations_of(DashboardParameters())}
    assert parameters.keys() <= declared.keys()
    settings = settings_from(DashboardParameters(), {**declared, **parameters})
    assert (settings.host, settings.port, settings.read_only) == ("0.0.0.0", 9000, True)
