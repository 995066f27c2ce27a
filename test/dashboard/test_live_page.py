"""The page of live nodes in a real browser: what is clicked reaches them, and they are seen."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")
pytest.importorskip("nicegui", reason="needs the extra dashboard")

from browser import NAMES, Browser, chromium
from rclpy.parameter import Parameter

from dashboard.live_robots import SECOND, LiveRobots
from dashboard.looking import (
    OUTSIDE,
    TIMEOUT,
    choose,
    click,
    free_port,
    mark,
    place_of,
    process,
    said,
    text,
    type_into,
)
from dashboard.looking import until as until_true
from nodes.conftest import reserved_domain
from twbr_estimation.cli.main import main as twbr
from twbr_estimation.configuration.files import read_settings
from twbr_estimation.configuration.filter_settings import DEFAULT_FILTER
from twbr_estimation.simulation.worlds import PAPER_CALIBRATION

NODE = "import sys; from twbr_estimation.nodes.dashboard_node import main; sys.exit(main())"
BAG = Path(__file__).resolve().parents[2] / "bags" / "verification"
TILTS = "twbr.robots.get(0).traces.get('reference')"
REFERENCE = f"{TILTS}.slice(-{{0}}).map(p => Math.abs(p[1]))"


class Scene(NamedTuple):
    """Robots, the browser that looks at their page, and the folder of its recordings."""

    robots: LiveRobots
    browser: Browser
    recordings: Path


def needs_browser() -> None:
    if chromium() is None:
        pytest.skip(f"none of {', '.join(NAMES)} is installed")


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Scene]:
    needs_browser()
    folder = tmp_path_factory.mktemp("page")
    recordings = folder / "recordings"
    given = [f"port:={free_port()}", f"record_folder:={recordings}", f"robots:=['', '{SECOND}']"]
    command = [sys.executable, "-c", NODE, "--ros-args"]
    for each in given:
        command += ["-p", each]
    with reserved_domain() as domain:
        robots = LiveRobots(domain)
        try:
            with process(command) as address, Browser(folder / "profile") as browser:
                browser.resize(1280, 900)
                browser.call("Page.navigate", url=address)
                until_true(browser, "window.twbr?.robots.get(0)?.frames > 3")
                yield Scene(robots, browser, recordings)
                assert browser.complaints() == []
        finally:
            robots.close()


def until(scene: Scene, condition: str) -> Any:
    """Wait for a condition in the browser, and require that no script has failed."""
    found = until_true(scene.browser, condition)
    assert scene.browser.complaints() == []
    return found


def seen(scene: Scene, words: str) -> None:
    until(scene, f"document.body.innerText.includes({words!r})")


def act(scene: Scene, action: str, words: str, first: str = "") -> None:
    """Press a button, again where nothing is said for long, and wait for its outcome.

    What is said stays for some seconds, and a press is lost while the page connects anew. Where
    the outcome needs it, another button is pressed `first` each time, half a second before.
    """
    for _ in range(4):
        if first:
            click(scene.browser, first)
            scene.robots.wait(0.5)
        click(scene.browser, action)
        end = time.monotonic() + 0.25 * TIMEOUT
        while time.monotonic() < end:
            if words in text(scene.browser):
                return
    pytest.fail(f"{action}: {words!r} was not said")


def parameter_of(scene: Scene, filter_name: str) -> str:
    """Wait until the list has parameters of a filter; return the first one's name."""
    marks = "[...document.querySelectorAll('[data-mark]')].map(each => each.dataset.mark)"
    return str(until(scene, f"{marks}.find(name => name.startsWith('{filter_name}.'))"))


def test_a_robot_that_balances_is_seen_with_its_figures(scene: Scene) -> None:
    said(scene.browser, "balancing with pid")
    for part in ("active: ", "complementary", "filter_node: estimating", "imu/data", "Losses: "):
        seen(scene, part)
    until(scene, f"{REFERENCE.format(30)}.length === 30")
    until(scene, "twbr.robots.get(0).errors.length > 10")
    assert until(scene, "twbr.robots.get(0).errors.slice(-1)[0][2] > 0"), "its own deviation"


def test_a_switched_filter_runs_in_the_node_and_shows_its_parameters(scene: Scene) -> None:
    browser = scene.browser
    choose(browser, "filter", "complementary")
    seen(scene, "filter is complementary")
    assert scene.robots.parameter("filter") == "complementary"
    parameter = parameter_of(scene, "complementary")
    assert scene.robots.filter.has_parameter(parameter)


def test_a_change_from_elsewhere_is_seen(scene: Scene) -> None:
    change = Parameter("filter", value=DEFAULT_FILTER)
    (result,) = scene.robots.filter.set_parameters([change])
    assert result.successful
    seen(scene, f"active: {DEFAULT_FILTER}")
    parameter_of(scene, DEFAULT_FILTER)


def test_a_refused_value_is_said_with_its_reason_and_goes_back(scene: Scene) -> None:
    before = scene.robots.parameter("valid_stddev")
    until(scene, f"{mark('valid_stddev')} !== null")
    type_into(scene.browser, "valid_stddev", "-3")
    seen(scene, "valid_stddev out of range")
    assert scene.robots.parameter("valid_stddev") == before
    value = "({0}.querySelector?.('input') ?? {0}).value".format(mark("valid_stddev"))
    until(scene, f"Math.abs(Number({value}) - {before}) < 1e-5")


def push_until_it_leans(scene: Scene) -> None:
    """Push, again where the lean was over between two pictures, as on a slow computer."""
    begin = scene.browser.evaluate("twbr.robots.get(0).latest()")
    leans = f"{TILTS}.some(p => p[0] > {begin} && Math.abs(p[1]) > 2)"
    for _ in range(6):
        click(scene.browser, "push forward")
        seen(scene, "pushed by 3 N")
        end = time.monotonic() + 0.1 * TIMEOUT
        while time.monotonic() < end:
            if scene.browser.evaluate(leans):
                return
            time.sleep(0.05)
    pytest.fail("it was pushed and did not lean")


def test_a_pushed_robot_leans_and_recovers(scene: Scene) -> None:
    said(scene.browser, "balancing")
    until(scene, f"Math.max(...{REFERENCE.format(30)}) < 1.5")
    push_until_it_leans(scene)
    until(scene, f"Math.max(...{REFERENCE.format(30)}) < 1.5")
    said(scene.browser, "balancing")


def test_a_recording_is_one_and_can_be_evaluated(
    scene: Scene, capsys: pytest.CaptureFixture[str]
) -> None:
    browser = scene.browser
    until(scene, f"{mark('record')} !== null")
    browser.evaluate(f"(() => {{ const b = {mark('record')}; b.click(); b.click(); }})()")
    seen(scene, "recording into")
    until(scene, f"{mark('stop recording')} !== null")
    scene.robots.wait(4.0)
    click(browser, "stop recording")
    until(scene, "/: [0-9]+ messages/.test(document.body.innerText)")
    (folder,) = scene.recordings.iterdir()
    assert {"metadata.yaml", f"{folder.name}.mcap", "config"} == {
        each.name for each in folder.iterdir()
    }
    assert twbr(["evaluate", str(folder), "--filter", "complementary"]) == 0
    assert "complementary" in capsys.readouterr().out


def test_the_settings_are_saved_as_a_file_that_the_nodes_take(scene: Scene, tmp_path: Path) -> None:
    browser = scene.browser
    browser.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    click(browser, "save")
    path, end = tmp_path / "filters.yaml", time.monotonic() + TIMEOUT
    while not path.exists():
        assert time.monotonic() < end, "nothing was saved"
        browser.evaluate("new Promise(done => setTimeout(done, 50))")
    settings = read_settings(path)
    assert settings.filter == scene.robots.parameter("filter")
    name, value = "complementary", scene.robots.parameter("complementary.time_constant")
    assert settings.values[name]["time_constant"] == value


def test_a_disabled_robot_falls_is_calibrated_enabled_and_stood_up(scene: Scene) -> None:
    for action, words in (
        ("disable", "disabled: the motors are cut"),
        ("reset filters", "the filters start afresh at the next sample"),
    ):
        act(scene, action, words)
    said(scene.browser, "motors cut: disabled")
    seen(scene, "simulator_node: fallen")
    scene.robots.wait(4.0)
    act(scene, "calibrate", "rad/s; not saved: the parameter calibration_file is empty")
    assert tuple(scene.robots.correction.get_parameter("calibration.gyro_bias").value) != (
        PAPER_CALIBRATION.gyro_bias
    )
    act(scene, "enable", "enabled; it balances as soon as it is stood up")
    act(scene, "stand up", "stood up at")
    said(scene.browser, "balancing with pid")
    act(scene, "calibrate", "the robot moved ", first="push forward")


def test_it_fits_a_phone(scene: Scene) -> None:
    scene.browser.resize(390, 844, mobile=True)
    try:
        until(scene, "window.innerWidth === 390 && document.documentElement.scrollWidth <= 390")
        until(scene, f"{OUTSIDE}.length === 0")
    finally:
        scene.browser.resize(1280, 900)


def test_the_other_robot_has_a_tab_of_its_own(scene: Scene) -> None:
    tab = f"[...document.querySelectorAll('.q-tab')].find(e => e.innerText.includes('{SECOND}'))"
    shown = f"{tab} && ({tab}.click(), twbr.robots.has(1))"  # anew where the page loads anew
    until(scene, f"{shown} && twbr.robots.get(1).traces.get('reference')?.length > 3")
    seen(scene, "simulator_node: held until a motor command")
    body = "objects.has(twbr.robots.get(1).ids.body)"
    until(scene, f"{shown} && getElement(twbr.robots.get(1).ids.scene)?.{body}")
    until(scene, "!document.body.innerText.includes('balancing')")
    choose(scene.browser, "node", "simulator_node")
    until(scene, f"{mark('push_force')} !== null")
    before = scene.robots.simulator.get_parameter("push_force").value
    type_into(scene.browser, "push_force", "1.25")
    seen(scene, "push_force is 1.25")
    assert scene.robots.second.get_parameter("push_force").value == 1.25
    assert scene.robots.simulator.get_parameter("push_force").value == before
    scene.browser.evaluate("document.querySelector('.q-tab').click()")
    said(scene.browser, "balancing")
    until(scene, f"!document.body.innerText.includes('{SECOND}/')")


def test_a_lost_node_is_said(scene: Scene) -> None:
    scene.robots.lose(scene.robots.filter)
    said(scene.browser, "stale: no tilt arrives")
    said(scene.browser, "filter_node silent")
    seen(scene, "filter_node: silent for")
    seen(scene, "filter_node is lost")


def test_a_recording_is_looked_at_with_a_slider(tmp_path: Path) -> None:
    needs_browser()
    command = [sys.executable, "-m", "twbr_estimation.cli.main", "view", str(BAG)]
    command += ["--port", str(free_port()), "--filter", "complementary"]
    with process(command) as address, Browser(tmp_path) as browser:
        browser.call("Page.navigate", url=address)
        until_true(browser, "window.twbr?.robots.get(0)?.traces.get('active')?.length > 3")
        until_true(browser, f"{mark('time')} !== null")
        until_true(browser, "document.body.innerText.includes('samples are saturated')")
        until_true(browser, "document.body.innerText.includes('active: complementary')")
        click(browser, "pause")
        said(browser, "paused")
        box = place_of(browser, "time")
        middle = box["top"] + box["height"] / 2
        place = {"x": box["right"] - 1, "y": middle, "button": "left", "clickCount": 1}
        for kind in ("mousePressed", "mouseReleased"):
            browser.call("Input.dispatchMouseEvent", type=kind, **place)
        end = browser.evaluate(f"{mark('state')}.innerText.match(/of ([0-9.]+) s/)[1]")
        until_true(browser, f"parseFloat({mark('state')}.innerText) > {float(end) - 1.0}")
        until_true(browser, f"twbr.robots.get(0).latest() > {float(end) - 1.0}")
        assert browser.complaints() == []
