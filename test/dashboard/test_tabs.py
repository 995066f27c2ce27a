"""The page of two robots: what a hidden tab, a lost node and a scrolled page leave to be seen."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("nicegui", reason="needs the extra dashboard")

from browser import NAMES, Browser, chromium

from dashboard.looking import choose, click, free_port, mark, process, type_into, until

PAGE = Path(__file__).parent / "fake_page.py"
CANVAS = "getHtmlElement(twbr.robots.get(0).ids.scene)?.querySelector('canvas')"
FIELD = f"{mark('kalman.q1')}.closest('.q-field')"


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Browser]:
    if chromium() is None:
        pytest.skip(f"none of {', '.join(NAMES)} is installed")
    command = [sys.executable, str(PAGE), str(free_port()), "two"]
    with process(command) as address, Browser(tmp_path) as running:
        running.resize(1280, 900)
        running.call("Page.navigate", url=address)
        until(running, "window.twbr?.robots.get(0)?.frames > 3")
        yield running
        assert running.complaints() == []


def show_tab(browser: Browser, index: int) -> None:
    shown = f"!!getHtmlElement(twbr.robots.get({index})?.ids.scene)?.offsetParent"
    until(browser, f"{shown} || (document.querySelectorAll('.q-tab')[{index}]?.click(), false)")
    until(browser, f"!getHtmlElement(twbr.robots.get({1 - index})?.ids.scene)?.offsetParent")


def test_a_scene_is_drawn_again_after_the_window_was_resized_on_another_tab(
    browser: Browser,
) -> None:
    size = f"[{CANVAS}?.clientWidth ?? 0, {CANVAS}?.clientHeight ?? 0]"
    fills = f"{CANVAS}.clientWidth === {CANVAS}.parentElement.clientWidth"
    until(browser, f"{size}[1] > 100 && {fills}")
    height = browser.evaluate(size)[1]
    show_tab(browser, 1)
    browser.resize(900, 700)
    until(browser, "innerWidth === 900")
    show_tab(browser, 0)
    until(browser, f"{size}[0] > 100 && {size}[1] === {height}")
    until(browser, fills)


def test_a_lost_node_stays_with_values_that_cannot_be_changed(browser: Browser) -> None:
    until(browser, f"{mark('kalman.q1')} !== null")
    until(browser, f"!{FIELD}.matches('.q-field--disabled')")
    click(browser, "lose")
    until(browser, f"{mark('lost')}.innerText.startsWith('filter_node is lost')")
    until(browser, f"{FIELD}.matches('.q-field--disabled')")
    type_into(browser, "search", "weights")
    until(browser, f"{mark('kalman.q1')} === null")
    type_into(browser, "search", "")
    until(browser, f"{mark('kalman.q1')} !== null && {FIELD}.matches('.q-field--disabled')")
    until(browser, f"{mark('node')}.closest('.q-field').innerText.includes('filter_node (lost)')")
    until(browser, f"{mark('filter')}.closest('.q-field').matches('.q-field--disabled')")
    until(browser, "document.body.innerText.includes('filter_node is not found')")
    choose(browser, "node", "mute_node")
    until(browser, f"{mark('lost')}.innerText === '' && {mark('kalman.q1')} === null")
    click(browser, "find")
    choose(browser, "node", "filter_node")
    until(browser, f"{mark('kalman.q1')} !== null && !{FIELD}.matches('.q-field--disabled')")
    until(browser, "!document.body.innerText.includes('filter_node is not found')")


def test_the_state_stays_in_sight_where_a_phone_is_scrolled(browser: Browser) -> None:
    browser.resize(390, 844, mobile=True)
    until(browser, "innerWidth === 390 && document.documentElement.scrollHeight > 2000")
    until(browser, "(scrollTo(0, 1500), scrollY > 1000)")
    top, bottom = browser.evaluate(
        f"(b => [b.top, b.bottom])({mark('state')}.getBoundingClientRect())"
    )
    assert 0 <= top < bottom <= 200
    place = f"(b => [b.left + b.width / 2, b.top + b.height / 2])({mark('state')}"
    middle = f"{place}.getBoundingClientRect())"
    assert browser.evaluate(f"{mark('state')}.contains(document.elementFromPoint(...{middle}))")
