"""The page in a real browser, on a laptop and on a phone."""

from __future__ import annotations

import math
import signal
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

pytest.importorskip("nicegui", reason="needs the extra dashboard")

from browser import NAMES, Browser, chromium

from dashboard.looking import (
    OUTSIDE,
    choose,
    click,
    free_port,
    hide,
    mark,
    place_of,
    press,
    process,
    running,
    said,
    text,
    type_into,
    until,
)

PAGE = Path(__file__).parent / "fake_page.py"


def serving(*arguments: str) -> AbstractContextManager[str]:
    """Serve a page of its own; gives its address."""
    return process([sys.executable, str(PAGE), str(free_port()), *arguments])


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with serving() as found:
        yield found


@pytest.fixture
def browser(address: str, tmp_path: Path) -> Iterator[Browser]:
    if chromium() is None:
        pytest.skip(f"none of {', '.join(NAMES)} is installed")
    with Browser(tmp_path) as running:
        running.resize(1280, 900)
        running.call("Page.navigate", url=address)
        until(running, "window.twbr && twbr.robots.get(0)?.frames > 3")
        yield running
        assert running.complaints() == []
        assert not [each for each in running.requests() if "127.0.0.1" not in each]


def test_pictures_arrive_and_show_the_robot(browser: Browser) -> None:
    until(browser, "twbr.robots.get(0).drawn > 3")
    until(browser, f"{mark('state')}?.innerText.includes('balancing')")
    series = "getElement(twbr.robots.get(0).ids.tilt).chart.getOption().series.map(s => s.name)"
    assert until(browser, f"{series}.length && {series}") == ["active", "raw", "reference"]
    until(browser, "document.body.innerText.includes('0.573')")  # the bias in deg
    numbers = f"{mark('tilt')}.innerText.match(/-?[0-9.]+/g).map(Number)"
    deg, rad, reference = until(browser, numbers)[:3]
    assert abs(math.radians(deg) - rad) < 2e-3 and abs(deg - reference - 0.573) < 0.2


def test_parameters_of_what_is_chosen_come_first(browser: Browser) -> None:
    marks = "[...document.querySelectorAll('.q-scrollarea [data-mark]')].map(e => e.dataset.mark)"
    shown = until(browser, f"{marks}.length > 2 && {marks}")
    assert shown[0] == "filter" and shown[-1] == "compare"


def test_the_tilt_of_a_robot_at_rest_is_drawn_small(browser: Browser) -> None:
    option = "getElement(twbr.robots.get(0).ids.tilt).chart.getOption()"
    limits = f"{option}.yAxis[0].%s({{ min: %s, max: %s }})"
    assert until(browser, f"typeof {option}.yAxis[0].min === 'function'")
    assert browser.evaluate(limits % ("min", -0.02, 0.03)) == -1.0
    assert browser.evaluate(limits % ("max", -0.02, 0.03)) == 1.5
    assert browser.evaluate(limits % ("min", -6, 4)) is None


def test_a_page_that_does_not_keep_up_says_so(browser: Browser) -> None:
    busy = "const end = performance.now() + 400; while (performance.now() < end);"
    browser.evaluate(f"window.busy = setInterval(() => {{ {busy} }}, 450), 0")
    until(browser, f"{mark('late')}.innerText.startsWith('late: ')")
    browser.evaluate("clearInterval(window.busy)")


def test_pictures_are_late_by_their_distance_or_their_age(browser: Browser) -> None:
    def said_of(apart: int, age: int, gap: int = 0) -> str:
        times = [apart * i + (gap if i > 10 else 0) for i in range(20)]
        return str(browser.evaluate(f"twbr.lateness({[[time, age] for time in times]})"))

    assert said_of(33, 50) == said_of(33, 50, gap=3000) == ""
    assert said_of(250, 50) == "late: 4.0 pictures a second"
    assert said_of(50, 1240) == "late: 20.0 pictures a second, 1.2 s behind"


def test_text_from_the_robot_is_not_markup(browser: Browser) -> None:
    until(browser, "document.body.innerText.includes('filter_node: <img')")
    assert browser.evaluate("document.querySelectorAll('img[src=x]').length") == 0


def test_a_paused_chart_stands_still_and_goes_on(browser: Browser) -> None:
    until(browser, "!!twbr.robots.get(0).listened")
    browser.evaluate("twbr.pause(0, true)")
    drawn = "getElement(twbr.robots.get(0).ids.tilt).chart.getOption().series[0].data.at(-1)[0]"
    before = browser.evaluate(drawn)
    frames = browser.evaluate("twbr.robots.get(0).frames")
    until(browser, f"twbr.robots.get(0).frames > {frames + 10}")
    assert browser.evaluate(drawn) == before
    browser.evaluate("twbr.pause(0, false)")
    until(browser, f"({drawn}) > {before}")


def test_a_parameter_is_changed_and_a_wrong_value_is_refused_with_its_reason(
    browser: Browser,
) -> None:
    until(browser, f"{mark('kalman.q1')} !== null")
    type_into(browser, "kalman.q1", "0.25")
    until(browser, "document.body.innerText.includes('kalman.q1 is 0.25')")
    type_into(browser, "kalman.q1", "7")
    until(browser, "document.body.innerText.includes('7.0 is not within 0 to 1')")
    value = f"({mark('kalman.q1')}.querySelector?.('input') ?? {mark('kalman.q1')}).value"
    until(browser, f"{value} == '0.25'")


def test_another_filter_is_chosen_and_its_parameters_are_shown(browser: Browser) -> None:
    until(browser, f"{mark('kalman.q1')} !== null && {mark('complementary.gain')} === null")
    choose(browser, "filter", "complementary")
    said(browser, "filter complementary")
    until(browser, f"{mark('kalman.q1')} === null && {mark('complementary.gain')} !== null")
    choose(browser, "filter", "kalman")
    said(browser, "filter kalman")


def test_a_node_that_does_not_answer_is_not_shown_with_the_values_of_another(
    browser: Browser,
) -> None:
    until(browser, f"{mark('kalman.q1')} !== null")
    choose(browser, "node", "mute_node")
    until(browser, "document.body.innerText.includes('mute_node: no answer for 3 s')")
    until(browser, f"{mark('kalman.q1')} === null")
    choose(browser, "node", "filter_node")
    until(browser, f"{mark('kalman.q1')} !== null")


def test_both_charts_show_the_time_that_one_is_zoomed_to(browser: Browser) -> None:
    charts = [f"getElement(twbr.robots.get(0).ids.{name}).chart" for name in ("tilt", "error")]
    until(browser, "!!twbr.robots.get(0).listened")
    shown = f"[{', '.join(f'{each}.getOption().dataZoom[0]' for each in charts)}]"
    browser.evaluate(
        f"{charts[1]}.dispatchAction({{ type: 'dataZoom', dataZoomIndex: 0, start: 20, end: 60 }})"
    )
    until(browser, f"{shown}.every(each => each.start === 20 && each.end === 60)")
    browser.evaluate("twbr.zoomOut(0)")
    until(browser, f"{shown}.every(each => each.start === 0 && each.end === 100)")


def test_values_under_the_pointer_are_shown_while_the_picture_stands_still(
    browser: Browser,
) -> None:
    shown = "getElement(twbr.robots.get(0).ids.tilt).chart.getOption().tooltip[0].show"
    until(browser, "!!twbr.robots.get(0).listened")
    until(browser, f"{shown} === false")  # also after a moment without pictures
    browser.evaluate("twbr.pause(0, true)")
    until(browser, shown)
    browser.evaluate("twbr.pause(0, false)")
    until(browser, f"!{shown}")


def test_a_text_is_shown_as_it_is_and_what_is_no_list_is_refused(browser: Browser) -> None:
    until(browser, f"{mark('kalman.frame')} !== null")
    value = "({0}.querySelector?.('input') ?? {0}).value"
    assert browser.evaluate(value.format(mark("kalman.frame"))) == "imu_link"
    type_into(browser, "kalman.frame", "true: [")
    until(browser, "document.body.innerText.includes('kalman.frame is true: [')")
    for wrong in ("[1, 2", "3", "{", "2020-13-45"):
        type_into(browser, "kalman.weights", wrong)
        until(browser, f"document.body.innerText.includes('{wrong}\\' is no list')")
        until(browser, f"{value.format(mark('kalman.weights'))} == '[1.0, 2.0]'")
    type_into(browser, "kalman.weights", "[1e-3, 4]")
    until(browser, "document.body.innerText.includes('kalman.weights is [0.001, 4.0]')")
    type_into(browser, "kalman.weights", "[1.0, 2.0]")
    type_into(browser, "kalman.frame", "imu_link")


@pytest.mark.parametrize("end", ["key", "focus", "hidden"])
def test_a_held_key_drives_until_it_is_released_or_the_page_is_closed(
    browser: Browser, end: str
) -> None:
    press(browser, "w")
    press(browser, "a")
    said(browser, "driven 0.2 1.5")
    if end == "key":
        press(browser, "w", "keyUp")
        said(browser, "driven 0 1.5")
        press(browser, "a", "keyUp")
    elif end == "focus":
        browser.evaluate("window.dispatchEvent(new Event('blur'))")
    else:
        hide(browser, True)
    said(browser, "driven 0 0")
    if end == "hidden":
        until(browser, "twbr.robots.get(0).socket.readyState === WebSocket.CLOSED")
        hide(browser, False)
        frames = browser.evaluate("twbr.robots.get(0).frames")
        until(browser, f"twbr.robots.get(0).frames > {frames + 3}")


def test_keys_that_are_typed_into_a_field_drive_nothing(browser: Browser) -> None:
    until(browser, f"{mark('search')} !== null")
    browser.evaluate(
        f"(() => {{ const e = {mark('search')}; (e.matches('input') ? e : e.querySelector('input'))"
        ".focus(); })()"
    )
    press(browser, "w")
    assert browser.evaluate("twbr.robots.get(0).pad.keys.size") == 0
    assert browser.evaluate("twbr.robots.get(0).pad.visible") is True


def test_the_pad_drives_while_it_is_held(browser: Browser) -> None:
    box = place_of(browser, "pad")
    x, y = box["left"] + box["width"] / 2, box["top"] + box["height"] / 2
    place = {"x": x, "button": "left", "clickCount": 1}
    browser.call("Input.dispatchMouseEvent", type="mousePressed", y=y - 16, **place)
    said(browser, "driven 0.1 0")
    browser.call("Input.dispatchMouseEvent", type="mouseMoved", y=y + 500, **place)
    said(browser, "driven -0.2 0")
    browser.call("Input.dispatchMouseEvent", type="mouseReleased", y=y + 500, **place)
    said(browser, "driven 0 0")


def test_a_trace_that_costs_much_is_received_once_the_legend_shows_it(browser: Browser) -> None:
    said(browser, "wanted nothing")
    chart = "getElement(twbr.robots.get(0).ids.tilt).chart"
    until(browser, "!!twbr.robots.get(0).listened")
    browser.evaluate(f"{chart}.dispatchAction({{ type: 'legendToggleSelect', name: 'raw' }})")
    said(browser, "wanted raw")


def test_an_action_shows_its_outcome(browser: Browser) -> None:
    click(browser, "calibrate")
    until(browser, "document.body.innerText.includes('calibrate done')")


def test_a_stalled_server_is_said_keeps_the_page_and_is_sent_no_late_action(
    tmp_path: Path,
) -> None:
    if chromium() is None:
        pytest.skip(f"none of {', '.join(NAMES)} is installed")
    command = [sys.executable, str(PAGE), str(free_port())]
    with running(command) as (server, address), Browser(tmp_path) as page:
        page.call("Page.navigate", url=address)
        until(page, f"window.twbr?.robots.get(0)?.frames > 3 && {mark('calibrate')} !== null")
        page.evaluate("window.isTheSame = true")
        server.send_signal(signal.SIGSTOP)
        try:
            until(page, f"{mark('late')}.innerText.startsWith('late: no connection for ')")
            page.evaluate("new Promise(done => setTimeout(done, 5000))")
            page.evaluate(f"{mark('calibrate')}.click()")
        finally:
            server.send_signal(signal.SIGCONT)
        until(page, f"!{mark('late')}.innerText.includes('no connection')")
        click(page, "lose")
        until(page, "document.body.innerText.includes('lose done')")
        assert "calibrate done" not in text(page)
        assert page.evaluate("window.isTheSame") is True, "nothing was loaded anew"
        assert page.complaints() == []


def test_it_fits_a_phone(browser: Browser) -> None:
    browser.resize(390, 844, mobile=True)
    until(browser, "window.innerWidth === 390")
    until(browser, "document.documentElement.scrollWidth <= 390")
    until(browser, "document.querySelectorAll('th').length >= 8")
    until(browser, f"{OUTSIDE}.length === 0")


def test_a_page_that_only_shows_offers_nothing(tmp_path: Path) -> None:
    if chromium() is None:
        pytest.skip(f"none of {', '.join(NAMES)} is installed")
    with serving("read-only") as address, Browser(tmp_path) as running:
        running.call("Page.navigate", url=address)
        until(running, f"{mark('kalman.q1')} !== null && {mark('figures')} !== null")
        assert "read-only" in text(running)
        assert "restart the figures" not in text(running)
        for name in ("calibrate", "pad"):
            assert running.evaluate(mark(name)) is None
        assert running.evaluate(f"{mark('kalman.q1')}.closest('.q-field--disabled') !== null")
        assert running.complaints() == []


def test_every_other_computer_needs_the_token() -> None:
    with serving("everywhere") as address:
        plain, _, token = address.partition("?token=")
        assert token and "0.0.0.0" not in address
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(plain, timeout=30.0)
        assert refused.value.code == 401
        with urllib.request.urlopen(address, timeout=30.0) as answer:
            assert answer.status == 200
