"""The package's layers: imports point down only, and the heavy ones stay where they belong."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "twbr_estimation"

PICTURE = PACKAGE.parent / "docs" / "architecture.md"


def documented_layers() -> list[set[str]]:
    """Return the names in the table of layers from the bottom row up."""
    rows = re.findall(r"^\| \w+ \| (`.+?`) \|", PICTURE.read_text(), re.MULTILINE)
    return [set(re.findall(r"`(\w+)`", row)) for row in reversed(rows)]


LAYERS = documented_layers()
"""Files and folders of the package from the bottom up; each may import its own layer and below."""

ROS = {
    "rclpy", "rcl_interfaces", "builtin_interfaces", "diagnostic_msgs", "geometry_msgs",
    "lifecycle_msgs", "rosgraph_msgs", "sensor_msgs", "std_msgs", "std_srvs", "tf2_msgs",
    "launch", "launch_ros", "ament_index_python", "rosidl_runtime_py",
}  # fmt: skip
HEAVY = {"allantools", "bokeh", "matplotlib", "mcap", "numba", "pandas", "rosbags", "scipy"}

MODULES = sorted(PACKAGE.rglob("*.py"))


def unit(path: Path) -> str:
    """Return the file or folder directly below the package that a module belongs to."""
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imported(path: Path) -> Iterator[str]:
    """Yield the full name of every module a file imports, anywhere in it."""
    package = ("twbr_estimation", *path.relative_to(PACKAGE).parent.parts)
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            parts = (*base, *((node.module,) if node.module else ()))
            if parts == ("twbr_estimation",):
                yield from (f"twbr_estimation.{alias.name}" for alias in node.names)
            else:
                yield ".".join(parts)


def layer(name: str) -> int:
    found = [index for index, names in enumerate(LAYERS) if name in names]
    assert len(found) == 1, f"{name} must stand once in the table of {PICTURE.name}"
    return found[0]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_point_down(path: Path) -> None:
    if path == PACKAGE / "__init__.py":
        return  # what it names is loaded when it is used: see the test of its cost
    for name in imported(path):
        parts = name.split(".")
        if parts[0] != "twbr_estimation" or parts[1] == "__version__":
            continue
        assert layer(parts[1]) <= layer(unit(path)), f"{path.name} imports {name}, a layer above"
        if {unit(path), parts[1]} == {"cli", "nodes"}:
            pytest.fail(f"{path.name} imports {name}: nodes and cli do not import each other")


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_ros_and_numba_stay_in_their_place(path: Path) -> None:
    roots = {name.split(".")[0] for name in imported(path)}
    if unit(path) != "nodes":
        assert not roots & ROS, "ROS is for nodes/ and launch/ only"
    if unit(path) != "compilation":
        assert "numba" not in roots, "only compilation.py compiles"


def loaded_by(*modules: str) -> set[str]:
    """Return the top-level modules in memory after importing `modules` in a fresh process."""
    program = f"import sys, {', '.join(modules)}; print(*{{m.split('.')[0] for m in sys.modules}})"
    result = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True
    )
    return set(result.stdout.split())


def test_the_live_path_loads_nothing_heavy() -> None:
    live = (
        "configuration.filter_settings",
        "streams.estimator",
        "filters",
        "pipeline.correction",
        "pipeline.pairing",
        "robot",
        "samples",
    )
    assert not loaded_by(*(f"twbr_estimation.{name}" for name in live)) & (HEAVY | ROS)


def test_nodes_load_nothing_heavy() -> None:
    pytest.importorskip("rclpy", reason="nodes need ROS 2 Jazzy")
    nodes = [f"twbr_estimation.nodes.{path.stem}" for path in (PACKAGE / "nodes").glob("[!_]*.py")]
    # The replay node reads recordings, which is what those packages are for.
    reading = {"twbr_estimation.nodes.replay_node"}
    assert not loaded_by(*(set(nodes) - reading)) & HEAVY
    if reading & set(nodes):
        assert not loaded_by(*reading) & (HEAVY - {"rosbags", "mcap"})


def test_importing_the_package_costs_nothing() -> None:
    assert not loaded_by("twbr_estimation") & (HEAVY | ROS | {"numpy", "rich", "yaml"})


def test_listing_filters_compiles_nothing() -> None:
    assert "numba" not in loaded_by("twbr_estimation.cli.main", "twbr_estimation.cli.filters")


def test_one_filter_by_name_reads_no_other() -> None:
    asked = "from twbr_estimation.filters import filter_named; filter_named('gyro')"
    loaded = subprocess.run(
        [sys.executable, "-c", f"{asked}; import sys; print(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    assert "twbr_estimation.filters.gyro" in loaded
    assert "twbr_estimation.filters.kalman" not in loaded


def test_a_filter_has_the_name_of_its_file() -> None:
    for path in (PACKAGE / "filters").glob("*.py"):
        defined = re.search(r"^FILTER = .*\n\s+(.*),", path.read_text(), re.MULTILINE)
        assert defined is None or defined[1] == f'name="{path.stem}"'


CONVENTIONAL = {"Parameters", "State", "Coefficients"}
"""Classes that every filter and controller may define in its own file."""


def test_no_two_public_classes_have_one_name() -> None:
    places: dict[str, list[str]] = {}
    for path in MODULES:
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places.setdefault(node.name, []).append(str(path.relative_to(PACKAGE)))
    twice = {name: found for name, found in places.items() if len(found) > 1}
    assert {name: found for name, found in twice.items() if name not in CONVENTIONAL} == {}
