"""The layouts for Foxglove, Lichtblick, PlotJuggler and RViz show what the nodes publish."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from twbr_estimation.configuration.urdf import FrameNames
from twbr_estimation.filters import listed_filters

ROOT = Path(__file__).resolve().parent.parent
CONFIG = ROOT / "config"
FOXGLOVE = json.loads((CONFIG / "foxglove.json").read_text())
PLOTJUGGLER = ET.parse(CONFIG / "plotjuggler.xml").getroot()
FLOAT = "std_msgs/msg/Float64"
FIGURES = {f"/evaluator_node/active/{name}": FLOAT for name in ("rmse_deg", "bias_deg")}
"""What the evaluator publishes once it has compared an estimator; the page has it in words."""
STEMS = {"sensor_msgs/msg/JointState": ("position", "velocity")}
RADIANS = r"\.(position|velocity|angular_velocity)\b"


def published() -> dict[str, str]:
    """Return the type of every topic in the generated page."""
    page = (ROOT / "docs" / "topics.md").read_text()
    rows = re.findall(r"^\| `(/?[\w/]+)` \| (\w+/msg/\w+) \|", page, re.MULTILINE)
    return {f"/{name.strip('/')}": kind for name, kind in rows} | FIGURES


TOPICS = published()
SCRIPTS = {
    re.search(r'output = "(\S+)"', each["sourceCode"])[1]: FLOAT  # type: ignore[index]
    for each in FOXGLOVE["userNodes"].values()
}


def message_paths() -> list[str]:
    return [
        path["value"] for each in FOXGLOVE["configById"].values() for path in each.get("paths", [])
    ]


def leaves(node: Any) -> Iterator[str]:
    if isinstance(node, str):
        yield node
    else:
        yield from leaves(node["first"])
        yield from leaves(node["second"])


def test_foxglove_has_a_place_for_every_panel_and_a_panel_in_every_place() -> None:
    assert sorted(leaves(FOXGLOVE["layout"])) == sorted(FOXGLOVE["configById"])


def example(kind: str) -> Any:
    """Return a message of this type with one element in every array."""
    package, _, name = kind.split("/")
    messages = pytest.importorskip(f"{package}.msg", reason="needs ROS 2")
    message = getattr(messages, name)()
    for stem in STEMS.get(kind, ()):
        setattr(message, stem, [0.0] * 3)
    return message


@pytest.mark.parametrize("path", message_paths())
def test_every_path_leads_to_a_number_in_degrees(path: str) -> None:
    topic, rest = re.fullmatch(r"(/[\w/]+)\.([^@]+?)(?:\.@\w+)?", path).groups()  # type: ignore[union-attr]
    value = example((TOPICS | SCRIPTS)[topic])
    for part in rest.split("."):
        name, index = re.fullmatch(r"(\w+)(?:\[(\d)\])?", part).groups()  # type: ignore[union-attr]
        value = getattr(value, name)
        value = value if index is None else value[int(index)]
    assert isinstance(value, (float, bool))
    assert bool(re.search(RADIANS, path)) == path.endswith(".@rad2deg")


def test_the_scripts_listen_to_topics_that_there_are() -> None:
    for each in FOXGLOVE["userNodes"].values():
        inputs = re.search(r"inputs = (\[.*?\])", each["sourceCode"])[1]  # type: ignore[index]
        assert set(json.loads(inputs)) <= set(TOPICS)


def sources() -> list[str]:
    """Return the names of every series that PlotJuggler must find in the messages."""
    made = {each.get("name") for each in PLOTJUGGLER.iter("snippet")}
    curves = [each.get("name", "") for each in PLOTJUGGLER.iter("curve")]
    linked = [each.text or "" for each in PLOTJUGGLER.iter("linked_source")]
    further = [each.text or "" for more in PLOTJUGGLER.iter("additional_sources") for each in more]
    assert made <= set(curves)
    return [each for each in curves + linked + further if each not in made]


def test_every_curve_is_a_series_that_plotjuggler_makes_of_our_messages() -> None:
    for source in sources():
        topic = max((each for each in TOPICS if source.startswith(f"{each}/")), key=len)
        rest = source.removeprefix(f"{topic}/").split("/")
        if TOPICS[topic] == "sensor_msgs/msg/JointState":
            joint, stem = rest
            names = {*FrameNames().wheels, "tilt", *listed_filters()}
            assert joint in names and stem in ("position", "velocity")
        elif topic == "/diagnostics":
            node, what = rest
            assert (ROOT / "twbr_estimation" / "nodes" / f"{node}.py").is_file() and what == "level"
        elif rest == ["orientation", "pitch"]:  # made by PlotJuggler of the quaternion
            assert TOPICS[topic] == "sensor_msgs/msg/Imu"
        else:
            value = example(TOPICS[topic])
            for part in rest:
                value = getattr(value, part)
            assert isinstance(value, (float, bool))


def test_rviz_shows_the_robot_in_the_frames_of_the_nodes() -> None:
    shown = yaml.safe_load((CONFIG / "robot.rviz").read_text())["Visualization Manager"]
    robot = next(each for each in shown["Displays"] if each["Class"].endswith("RobotModel"))
    assert robot["Description Topic"]["Value"] == "robot_description"
    assert robot["Description Topic"]["Durability Policy"] == "Transient Local"
    page = (ROOT / "docs" / "topics.md").read_text()
    assert f"| `tf_parent` | `{shown['Global Options']['Fixed Frame']}` |" in page
