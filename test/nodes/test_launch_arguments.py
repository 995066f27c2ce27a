"""Arguments that several launch files share."""

from __future__ import annotations

from pathlib import Path

import pytest

from twbr_estimation.nodes.dashboard_node import DashboardParameters
from twbr_estimation.nodes.declarations import declarations_of, settings_from
from twbr_estimation.nodes.launch_arguments import PAGE_ARGUMENTS, lossless, page_parameters

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


@pytest.mark.parametrize(
    ("namespace", "topic"),
    [("", "/imu/data_raw"), ("robot1", "/robot1/imu/data_raw"), ("/a/b/", "/a/b/imu/data_raw")],
)
def test_topics_without_loss_follow_the_nodes_into_a_namespace(namespace: str, topic: str) -> None:
    file = Path(__file__).resolve().parents[2] / "config" / "lossless.yaml"
    parameters = lossless(file, namespace)
    assert parameters[f"qos_overrides.{topic}.subscription.reliability"] == "reliable"
    assert len(parameters) == 6
