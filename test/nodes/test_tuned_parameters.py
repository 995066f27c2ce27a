"""The file that `twbr tune` writes goes into the nodes as it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from twbr_estimation.cli.main import main
from twbr_estimation.cli.simulate import write_simulated
from twbr_estimation.configuration.files import read_correction, read_settings
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.simulation import simulate

NAMES = ("alpha_beta_wb", "complementary", "kalman_tuned")


def test_nodes_take_tuned_parameters_from_the_file(graph: Any, tmp_path: Path) -> None:
    for seed in (51, 52):
        write_simulated(tmp_path / f"drive {seed}", simulate("paper", 0.01, 10.0, seed))
    bags = [str(tmp_path / "drive 51"), "--verify", str(tmp_path / "drive 52")]
    chosen = [word for name in NAMES for word in ("--filter", name)]
    assert main(["tune", *bags, *chosen, "--jobs", "1", "-o", str(tmp_path / "mine")]) == 0
    file = tmp_path / "mine" / "filters.yaml"
    command = ["--ros-args", "--params-file", str(file)]
    node = graph.add(FilterNode(**graph.options(), cli_args=command))
    settings = read_settings(file)
    assert node.get_parameter("filter").value == settings.filter
    for name in NAMES:
        for parameter, value in settings.values[name].items():
            taken = node.get_parameter(f"{name}.{parameter}").value
            assert taken == pytest.approx(value, rel=1e-12), f"{name}.{parameter}"
    correction = read_correction(file)
    assert correction is not None
    node = graph.add(CorrectionNode(**graph.options(), cli_args=command))
    taken = node.get_parameter("correction.rate_time_constant").value
    assert taken == pytest.approx(correction.rate_time_constant, rel=1e-12)


def test_written_files_can_be_loaded_by_ros2_param(tmp_path: Path) -> None:
    """It reads each value as YAML a second time, which made a date of the provenance's."""
    from rclpy.parameter import parameter_dict_from_yaml_file

    from twbr_estimation.configuration.files import date_of_now, write_section
    from twbr_estimation.robot import Calibration

    file = tmp_path / "calibration.yaml"
    provenance = {"source": "service ~/calibrate of a robot at rest", "date": date_of_now()}
    write_section(file, Calibration(), {**provenance, "duration": 4.5})
    loaded = parameter_dict_from_yaml_file(str(file), True)
    assert loaded["provenance.date"].value.string_value == provenance["date"]
    assert len(loaded["calibration.gyro_bias"].value.double_array_value) == 3
