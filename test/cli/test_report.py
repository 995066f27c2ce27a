"""`twbr report` as a user meets it: page, pictures, and a look at them in a real browser."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import NAMES, Browser, chromium

from twbr_estimation.bags import write_recording
from twbr_estimation.cli.main import main
from twbr_estimation.cli.simulate import write_simulated
from twbr_estimation.recording import ImuTrack, TiltTrack
from twbr_estimation.report.palette import MOTION
from twbr_estimation.simulation import simulate

pytest.importorskip("bokeh", reason="the extra `report` is not installed")

FILTERS = ("--filter", "complementary", "--filter", "alpha_beta_wb", "--filter", "accelerometer")
HOSTILE = "</script><script>boom()</script>"
"""A name that must stay a name."""
DESKTOP, PHONE = (1280, 800), (390, 844)


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A drive with a gap and another estimator, in a folder of a hostile name; a plain one."""
    folder = tmp_path_factory.mktemp("bags")
    first, second = folder / "<b>drive&1", folder / "drive2"
    simulated = simulate("paper", 0.002, 8.0, 61)
    recording = simulated.recording
    assert recording.reference is not None
    keep = np.r_[0:1000, 1200:4000]
    imu = recording.imu
    chip = TiltTrack(recording.reference.stamps, recording.reference.tilt + 0.1)
    recording = replace(
        recording,
        imu=ImuTrack(imu.stamps[keep], imu.gyro[keep], imu.accel[keep]),
        estimators={"chip": chip},
    )
    write_simulated(first, replace(simulated, recording=recording))
    write_recording(second, simulate("paper", 0.002, 6.0, 62).recording)
    return first, second


@pytest.fixture(scope="module")
def folder(bags, tmp_path_factory) -> Path:
    """The report of both recordings."""
    made = tmp_path_factory.mktemp("report") / "made"
    command = ["report", str(bags[0]), *FILTERS, "--estimator", f"{HOSTILE}=/imu/chip"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["/usr/bin/twbr", *command, "-o", str(made)])
        assert main([*command, "-o", str(made)]) == 0
    return made


@pytest.fixture(scope="module")
def page(folder) -> str:
    return (folder / "report.html").read_text()


@pytest.fixture(scope="module")
def browser(tmp_path_factory) -> Iterator[Browser]:
    if chromium() is None:
        pytest.skip(f"no browser: none of {', '.join(NAMES)} is installed")
    with Browser(tmp_path_factory.mktemp("profile")) as running:
        yield running


def test_the_page_holds_what_evaluate_says(bags, page, capsys) -> None:
    command = ["evaluate", str(bags[0]), *FILTERS, "--estimator", "chip=/imu/chip", "--json", "-"]
    assert main(command) == 0
    scores = json.loads(capsys.readouterr().out)["recordings"][0]["estimators"]
    for score in scores.values():
        assert f"<td>{score['mse_deg2']:.4f}</td>" in page
    assert "calibration, wheel" in page
    assert "<dt>twbr_estimation</dt>" in page
    assert "gaps longer than" in page  # the repair
    assert "twbr report &#39;" in page and "--filter complementary" in page


def test_users_strings_are_text(page) -> None:
    assert HOSTILE not in page
    assert "<b>drive" not in page
    assert "&lt;b&gt;drive&amp;1" in page


def test_the_picture_is_there(folder) -> None:
    assert (folder / "tilt.png").read_bytes().startswith(b"\x89PNG")
    assert sorted(path.name for path in folder.iterdir()) == ["report.html", "tilt.png"]


def test_nothing_is_overwritten_unasked(bags, folder, capsys) -> None:
    before = (folder / "report.html").stat().st_mtime_ns
    assert main(["report", str(bags[1]), "-o", str(folder)]) == 1
    assert "report.html: exists already; --overwrite replaces it" in capsys.readouterr().err
    assert (folder / "report.html").stat().st_mtime_ns == before


def test_an_interrupt_leaves_nothing(bags, tmp_path, monkeypatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("twbr_estimation.cli.report.render", interrupted)
    assert main(["report", str(bags[1]), *FILTERS, "-o", str(tmp_path / "made")]) == 130
    assert not (tmp_path / "made").exists()


def test_several_recordings_one_without_reference_one_too_short_for_spectra(
    bags, tmp_path, capsys
) -> None:
    plain = simulate("paper", 0.002, 4.0, 63).recording
    write_recording(tmp_path / "short", plain)
    write_recording(tmp_path / "bag", replace(plain, reference=None, truth=None))
    assert (
        main(["report", str(bags[1]), str(bags[1]), *FILTERS[:2], "-o", str(tmp_path / "a")]) == 0
    )
    assert main(["report", str(tmp_path / "bag"), *FILTERS[:2], "-o", str(tmp_path / "b")]) == 0
    assert "tilt_2.png" in capsys.readouterr().out
    assert main(["report", str(tmp_path / "short"), *FILTERS[:2], "-o", str(tmp_path / "c")]) == 0
    assert "at least 5 s are needed" in (tmp_path / "c" / "report.html").read_text()
    both = (tmp_path / "a" / "report.html").read_text()
    assert "Mean over 2 recordings" in both
    assert "There is no reference" in (tmp_path / "b" / "report.html").read_text()


def test_a_missing_package_is_named(bags, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setitem(sys.modules, "bokeh", None)
    assert main(["report", str(bags[1]), *FILTERS[:2], "-o", str(tmp_path / "made")]) == 1
    assert "a report needs bokeh: pip install" in capsys.readouterr().err


INK = """
(async () => {
  const pause = duration => new Promise(done => setTimeout(done, duration));
  const frame = () => new Promise(done => requestAnimationFrame(done));
  while (!(Bokeh.documents.length && Bokeh.documents[0].is_idle)) await pause(50);
  await pause(300);
  await frame(); await frame();  // what was asked for before has now been painted
  function* canvases(node) {
    for (const element of node.querySelectorAll("*")) {
      if (element.tagName === "CANVAS") yield element;
      if (element.shadowRoot) yield* canvases(element.shadowRoot);
    }
  }
  const wanted = %s.match(/\\w\\w/g).map(digits => parseInt(digits, 16));
  return [...document.querySelectorAll(".plot")].map(plot => {
    let count = 0;
    for (const canvas of canvases(plot)) {
      if (!canvas.width || !canvas.height) continue;
      const context = canvas.getContext("2d");
      const {data} = context.getImageData(0, 0, canvas.width, canvas.height);
      for (let i = 0; i < data.length; i += 4)
        if (data[i + 3] > 200 && wanted.every((value, k) => Math.abs(data[i + k] - value) < 12))
          count++;
    }
    return count;
  });
})()
"""
"""Number of pixels of one colour in every plot."""
TICK = """
(() => {
  const box = [...document.querySelectorAll("input[data-recording]")].find(b => b.value === %s);
  const before = box.checked;
  box.click();
  return [before, box.closest("tr").querySelector("line").getAttribute("stroke")];
})()
"""


def ink(browser: Browser, colour: str) -> list[int]:
    return browser.evaluate(INK % json.dumps(colour.lstrip("#")))


def with_and_without(browser: Browser, estimator: str) -> tuple[list[int], list[int]]:
    """Return the ink of an estimator's colour in every plot, first ticked and then not."""
    ticked, colour = browser.evaluate(TICK % json.dumps(estimator))
    once = ink(browser, colour)
    assert browser.evaluate(TICK % json.dumps(estimator)) == [not ticked, colour]
    again = ink(browser, colour)
    return (again, once) if ticked else (once, again)


def test_in_a_browser_all_plots_are_drawn(browser, folder) -> None:
    browser.resize(*DESKTOP)
    browser.open(folder / "report.html")
    assert browser.complaints() == []
    assert {address.split(":")[0] for address in browser.requests()} <= {"file", "data"}
    assert browser.evaluate("document.querySelectorAll('.plot').length") == 4
    tilt, _, _, spectrum = ink(browser, MOTION)
    assert tilt > 500 and spectrum > 100  # the reference, and its spectrum
    # The accelerometer is far off, so nothing covers it; its spectrum is the corrected angle's.
    drawn, hidden = with_and_without(browser, "accelerometer")
    assert all(drawn[kind] > hidden[kind] + 50 for kind in range(3)), (drawn, hidden)
    drawn, hidden = with_and_without(browser, "complementary")
    assert drawn[3] > hidden[3] + 50, (drawn, hidden)
    assert browser.complaints() == []


def test_in_a_browser_both_time_plots_zoom_together(browser, folder) -> None:
    browser.resize(*DESKTOP)
    browser.open(folder / "report.html")
    browser.evaluate("Bokeh.documents[0].roots()[0].x_range.setv({start: 2, end: 3})")
    range_of_error = "Bokeh.documents[0].roots()[1].x_range"
    assert browser.evaluate(f"[{range_of_error}.start, {range_of_error}.end]") == [2, 3]


def test_on_a_phone_nothing_is_wider_than_the_screen(browser, folder) -> None:
    browser.resize(*PHONE, mobile=True)
    browser.open(folder / "report.html")
    assert browser.complaints() == []
    width = browser.evaluate("document.documentElement.scrollWidth")
    assert width == PHONE[0]
    widths = browser.evaluate(
        "[...document.querySelectorAll('.plot')].map(p => p.getBoundingClientRect().width)"
    )
    assert all(300.0 < plot <= PHONE[0] for plot in widths)
    tilt, _, _, spectrum = ink(browser, MOTION)
    assert tilt > 200 and spectrum > 100
    size = browser.evaluate("parseFloat(getComputedStyle(document.querySelector('td')).fontSize)")
    assert size >= 14.0
    # A finger scrolls the page: no tool holds on to it until the reader picks one.
    active = "Bokeh.documents[0].roots().flatMap(p => p.toolbar.tools).filter(t => t.active).length"
    assert browser.evaluate(active) == 0
