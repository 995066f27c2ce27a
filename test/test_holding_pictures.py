"""Each calibration has a picture of how the robot is held, drawn by the command beside it."""

from __future__ import annotations

import argparse
import runpy
from pathlib import Path
from xml.etree import ElementTree

import pytest

from twbr_estimation.cli import calibrate

ROOT = Path(__file__).parent.parent
TOOL = runpy.run_path(str(ROOT / "tools" / "holding_pictures.py"))


def kinds() -> list[str]:
    subparsers = argparse.ArgumentParser().add_subparsers()
    calibrate.add_parser(subparsers)
    parser = subparsers.choices["calibrate"]
    (chosen,) = (each for each in parser._actions if isinstance(each, argparse._SubParsersAction))
    return sorted(chosen.choices)


@pytest.mark.parametrize("kind", kinds())
def test_each_calibration_shows_how_to_hold_the_robot(kind: str) -> None:
    drawn = TOOL["picture"](kind)
    ElementTree.fromstring(drawn)
    assert (ROOT / "docs" / "pictures" / f"hold_{kind}.svg").read_text(encoding="utf-8") == drawn
    page = (ROOT / "docs" / "calibration.md").read_text(encoding="utf-8")
    assert f"(pictures/hold_{kind}.svg)" in page
