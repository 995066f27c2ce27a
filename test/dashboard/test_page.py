"""The page in a real browser, on a laptop and on a phone."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui", reason="needs the extra dashboard")

from test.report.browser import NAMES, Browser, chromium

PAGE = Path(__file__).parent / "fake_page.py"
TIMEOUT = 60.0


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def until(browser: Browser, condition: str) -> Any:
    """Return the first value of a JavaScript expression that is true."""
    end = time.monotonic() + TIMEOUT
    while not (found := browser.evaluate(condition)):
        assert time.monotonic() < end, f"never true: {condition}\n{browser.complaints()}"
        time.sleep(0.05)
    return found


def text(browser: Browser) -> str:
    return str(browser.evaluate("document.body.innerText"))


def mark(name: str) -> str:
    return f"document.querySelector('[data-mark=\"{name}\"]')"


def type_into(browser: Browser, name: str, value: str) -> None:
    """Replace what a field holds, and leave it."""
    browser.evaluate(
        f"(() => {{ const e = {mark(name)}; const i = e.matches('input') ? e : e.querySelector"
        f"('input'); i.focus(); i.value = '{value}'; i.dispatchEvent(new Event('input'));"
        " i.dispatchEvent(new Event('change')); i.blur(); })()"
    )


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    port = free_port()
    command = [sys.executable, str(PAGE), str(port)]
    plain = {key: value for key, value in os.environ.items() if not key.startswith("PYTEST")}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=plain) as server:
        try:
            assert server.stdout is not None
            yield server.stdout.readline().strip()
        finally:
            server.terminate()


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
    assert until(browser, f"{series}.length && {series}") == ["active", "reference"]
    until(browser, "document.body.innerText.includes('0.573')")  # the bias in deg


def test_text_from_the_robot_is_not_markup(browser: Browser) -> None:
    until(browser, "document.body.innerText.includes('filter_node: <img')")
    assert browser.evaluate("document.querySelectorAll('img[src=x]').length") == 0


def test_a_paused_chart_stands_still_and_goes_on(browser: Browser) -> None:
    browser.evaluate("twbr.pause(0, true)")
    drawn = "getElement(twbr.robots.get(0).ids.tilt).chart.getOption().series[0]?.data.length ?? 0"
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


def test_another_filter_is_chosen_from_the_list(browser: Browser) -> None:
    until(browser, "document.body.innerText.includes('active filter')")
    until(browser, f"{mark('filter')} !== null")
    browser.evaluate(f"{mark('filter')}.closest('.q-field').click()")
    option = "[...document.querySelectorAll('.q-item')].find(e => e.innerText == 'complementary')"
    until(browser, f"!!{option}")
    browser.evaluate(f"{option}.click()")
    until(browser, f"{mark('state')}.innerText.includes('filter complementary')")


def test_an_action_shows_its_outcome(browser: Browser) -> None:
    until(browser, f"{mark('calibrate')} !== null")
    browser.evaluate(f"{mark('calibrate')}.click()")
    until(browser, "document.body.innerText.includes('calibrate done')")


def test_it_fits_a_phone(browser: Browser) -> None:
    browser.resize(390, 844, mobile=True)
    until(browser, "window.innerWidth === 390")
    until(browser, "document.documentElement.scrollWidth <= 390")
    widest = "Math.max(...[...document.querySelectorAll('.q-card')].map(e => e.offsetWidth))"
    assert browser.evaluate(widest) <= 390
