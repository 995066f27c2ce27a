"""What several launch files take from their arguments; it does not import `launch`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import yaml

from .dashboard_node import DashboardParameters

DEFAULTS = DashboardParameters()


class PageArgument(NamedTuple):
    """One argument of a launch file."""

    name: str
    default: str
    description: str
    switch: bool = False


PAGE_ARGUMENTS = (
    PageArgument("dashboard", "false", "Serve a web page of the robot (dashboard_node).", True),
    PageArgument(
        "dashboard_host", DEFAULTS.host, "Address of the page; 0.0.0.0: every network, by token."
    ),
    PageArgument("dashboard_port", str(DEFAULTS.port), "TCP port of the page."),
    PageArgument(
        "dashboard_token", "", "What a browser elsewhere must give; empty: a new one each time."
    ),
    PageArgument("dashboard_read_only", "false", "The page only shows.", True),
)


def page_parameters(given: Mapping[str, str]) -> dict[str, object] | None:
    """Return the parameters of `dashboard_node`; None where no page is asked for.

    Args:
        given: Launch configurations by name.
    """
    if given["dashboard"] != "true":
        return None
    return {
        "host": given["dashboard_host"],
        "port": int(given["dashboard_port"]),
        "token": given["dashboard_token"],
        "read_only": given["dashboard_read_only"] == "true",
    }


def lossless(file: Path, namespace: str) -> dict[str, object]:
    """Return the parameters of the file lossless.yaml, its topics moved into a namespace.

    Args:
        file: That file.
        namespace: With or without a slash; empty for none.
    """
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    prefix = f"/{namespace.strip('/')}" if namespace.strip("/") else ""
    topics = content["/**"]["ros__parameters"]["qos_overrides"]
    return {
        f"qos_overrides.{prefix}{topic}.subscription.{name}": value
        for topic, policies in topics.items()
        for name, value in policies["subscription"].items()
    }
