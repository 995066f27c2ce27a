"""What the tests of the page do in a browser."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from browser import Browser

TIMEOUT = 180.0
"""Longest wait for what must come [s]; ends a test that fails, also on a slow machine."""
OUTSIDE = (
    "[...document.querySelectorAll('.q-card, th, td, button, .q-badge, [data-mark]')]"
    ".filter(e => e.offsetParent && e.getBoundingClientRect().right > innerWidth)"
    ".map(e => e.outerHTML.slice(0, 200))"
)
"""Elements that reach beyond the right edge of the page."""


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def until(browser: Browser, condition: str) -> Any:
    """Return the first value of a JavaScript expression that is true.

    The page loads anew when its connection was lost for long; until it has, nothing is asked.
    """
    end = time.monotonic() + TIMEOUT
    while not (found := browser.evaluate(f"document.readyState === 'complete' && ({condition})")):
        assert time.monotonic() < end, f"never true: {condition}\n{browser.complaints()}"
        time.sleep(0.05)
    return found


def text(browser: Browser) -> str:
    return str(browser.evaluate("document.body?.innerText ?? ''"))


def mark(name: str) -> str:
    return f"document.querySelector('[data-mark=\"{name}\"]')"


def click(browser: Browser, name: str) -> None:
    """Click what is marked so, as soon as it is there and the page has a connection."""
    until(browser, f"twbr.isConnected() && (e => e !== null && (e.click(), true))({mark(name)})")


def type_into(browser: Browser, name: str, value: str) -> None:
    """Replace what a field holds, and leave it a moment later."""
    until(browser, f"{mark(name)} !== null")
    browser.evaluate(
        f"(async () => {{ const e = {mark(name)}; const i = e.matches('input') ? e : "
        f"e.querySelector('input'); i.focus(); i.value = '{value}'; "
        "i.dispatchEvent(new Event('input')); await new Promise(done => setTimeout(done, 50)); "
        "i.dispatchEvent(new Event('change')); i.blur(); })()"
    )


def press(browser: Browser, key: str, kind: str = "keyDown") -> None:
    browser.call("Input.dispatchKeyEvent", type=kind, key=key, code=f"Key{key.upper()}")


def place_of(browser: Browser, name: str) -> dict[str, float]:
    """Return the box of what is marked so, in pixels, as soon as nothing moves it any more."""
    box = f"JSON.stringify({mark(name)}?.getBoundingClientRect() ?? null)"
    still = (
        f"new Promise(done => {{ const first = {box}; "
        f"setTimeout(() => done(first === {box} && first), 500); }})"
    )
    end = time.monotonic() + TIMEOUT
    while (found := browser.evaluate(still)) in (False, "null"):
        assert time.monotonic() < end, f"{name} has no place that lasts"
    return dict(json.loads(found))


def said(browser: Browser, words: str) -> None:
    """Wait until the robot's state has these words."""
    until(browser, f"{mark('state')}?.innerText.includes('{words}')")


def hide(browser: Browser, hidden: bool) -> None:
    """Hide the page, or show it again."""
    browser.evaluate(
        f"Object.defineProperty(document, 'hidden', {{ value: {str(hidden).lower()}, "
        "configurable: true }); document.dispatchEvent(new Event('visibilitychange'))"
    )


def choose(browser: Browser, name: str, option: str) -> None:
    """Choose from the list of a select, which is opened anew where the page was loaded anew."""
    item = f"[...document.querySelectorAll('.q-item')].find(e => e.innerText == '{option}')"
    field = f"{mark(name)}?.closest('.q-field')"
    opened = "document.querySelector('.q-menu')"
    until(
        browser,
        f"(item => item ? (item.click(), true) : ({opened} || {field}?.click(), false))({item})",
    )
    until(browser, f"!{opened}")


@contextmanager
def process(command: Sequence[str], **environment: str) -> Iterator[str]:
    """Run a program that serves a page; yield the page's address."""
    with running(command, **environment) as (_, address):
        yield address


@contextmanager
def running(
    command: Sequence[str], **environment: str
) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run a program that serves a page; yield it and the last word of what it says first."""
    plain: Mapping[str, str] = {
        key: value for key, value in os.environ.items() if not key.startswith("PYTEST")
    }
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**plain, **environment},
    ) as server:
        try:
            assert server.stdout is not None
            line = ""
            while "http://" not in line:
                line = server.stdout.readline()
                assert line, "the server has ended"
            yield server, line.split()[-1]
        finally:
            server.terminate()
