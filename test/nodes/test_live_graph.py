"""A replayed recording through correction, filters and evaluator gives the offline figures."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from twbr_estimation.bags import write_recording
from twbr_estimation.filters.base import filters
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.nodes.evaluator_node import EvaluatorNode
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.nodes.replay_node import ReplayNode
from twbr_estimation.offline import Request, evaluate
from twbr_estimation.simulation import simulate, world_named

INPUTS = ("imu/data_raw", "joint_states", "reference/joint_states")
OUTPUTS = ("imu/data_corrected", "imu/data", "tilt/compare")


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated drive of five seconds."""
    folder = tmp_path_factory.mktemp("drive") / "bag"
    run = simulate(world_named("paper"), dt=0.002, duration=5.0, seed=11)
    write_recording(folder, run.recording)
    return folder


def test_live_figures_equal_offline_figures(graph: Any, bag: Path) -> None:
    lossless = graph.lossless(*INPUTS, *OUTPUTS, published=(*INPUTS, *OUTPUTS))
    graph.add(CorrectionNode(**graph.options(**lossless)))
    graph.add(FilterNode(**graph.options(**lossless, filter="complementary", compare=["all"])))
    evaluator = graph.add(EvaluatorNode(**graph.options(**lossless)))
    player = graph.add(ReplayNode(**graph.options(bag=str(bag), rate=0.0, delay=0.5))).player
    graph.spin_until(lambda: player.passes == 1, limit=60.0)
    (live,) = evaluator.finish()
    offline = evaluate(bag, Request())
    assert player.stalls == 0
    assert live.samples == offline.samples == 2500
    assert set(live.estimators) == {*filters(), "active"}
    for name, found in live.estimators.items():
        expected = offline.estimators["complementary" if name == "active" else name]
        assert asdict(found) == pytest.approx(asdict(expected), rel=1e-6, abs=1e-9), name
