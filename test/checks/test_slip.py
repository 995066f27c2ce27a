"""Short slips are found on ice, and neither bumps nor honest drives pass for them."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.checks.check import check
from twbr_estimation.checks.finding import Finding, noteworthy
from twbr_estimation.physics import simulate
from twbr_estimation.simulation import Simulated
from twbr_estimation.simulation import simulate as simulate_rig

pytest.importorskip("mujoco")
DT, SECONDS = 0.005, 20.0


def of_wheels(drive: Simulated) -> dict[str, Finding]:
    """Return the findings about the wheels by check."""
    found = noteworthy(check(drive.recording, drive.setup))
    return {each.check: each for each in found if each.subject == "wheels"}


@pytest.mark.parametrize(("world", "seed"), [("W1", 61), ("W2", 62), ("W4", 68)])
def test_ice_is_named_with_its_time(world: str, seed: int) -> None:
    drive = simulate("ice", DT, SECONDS, seed, world=world)
    found = of_wheels(drive)["slip"]
    first = drive.recording.imu.stamps[0]
    slippery = [
        (1e-9 * (e.begin - first), 1e-9 * (e.end - first)) for e in drive.events if e.name == "ice"
    ]
    named = [float(each) for each in re.findall(r"([0-9.]+) s,", found.text)]
    assert any(begin - 0.5 < at < end + 0.3 for begin, end in slippery for at in named)


@pytest.mark.parametrize(
    ("scene", "world", "seed"),
    [("drive", "W3", 65), ("drive", "W4", 66), ("pushes", "W2", 3), ("ramp", "W2", 68)],
)
def test_honest_drives_do_not_slip(scene: str, world: str, seed: int) -> None:
    drive = simulate(scene, DT, SECONDS, seed, world=world)
    assert drive.falls == 0
    assert of_wheels(drive) == {}


def test_bumps_are_no_slip() -> None:
    assert "slip" not in of_wheels(simulate("bumps", DT, SECONDS, 69, world="W2"))


def test_wheels_that_spin_for_a_moment_slip() -> None:
    drive = next(
        each for seed in range(71, 90) if not (each := simulate_rig("W1", DT, 20.0, seed)).falls
    )
    wheels = drive.recording.wheels
    assert wheels is not None and "slip" not in of_wheels(drive)
    since = 1e-9 * (wheels.stamps - wheels.stamps[0]) - 12.0
    spun = 2.0 / (1.0 + np.exp(-since / 0.08))  # two rad further within 0.3 s
    angle = wheels.angle + spun[:, None]
    slipped = replace(
        drive, recording=replace(drive.recording, wheels=replace(wheels, angle=angle))
    )
    assert "at 11." in of_wheels(slipped)["slip"].text
