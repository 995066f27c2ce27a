"""Who may open the page."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from twbr_estimation.dashboard.access import Access

Answer = list[dict[str, Any]]


def ask(access: Access, path: str = "/", kind: str = "http", **headers: str) -> Answer:
    """Send one request and return the messages of the answer."""
    name, _, query = path.partition("?")
    scope = {
        "type": kind,
        "path": name,
        "query_string": query.encode(),
        "headers": [(key.encode(), value.encode()) for key, value in headers.items()],
    }
    sent: list[dict[str, Any]] = []

    async def receive() -> dict[str, Any]:
        return {"type": "websocket.connect"}

    async def send(message: dict[str, Any]) -> None:
        sent.append(message)

    asyncio.run(access(scope, receive, send))
    return sent


async def page(scope: Any, receive: Any, send: Any) -> None:
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"the page"})


LOCAL = Access(page, token="", loopback=True)
REMOTE = Access(page, token="secret", loopback=False)


def test_this_computer_needs_no_token() -> None:
    assert ask(LOCAL, host="localhost:8080")[0]["status"] == 200
    assert ask(LOCAL, host="127.0.0.1:8080")[0]["status"] == 200
    assert ask(LOCAL, host="[::1]:8080")[0]["status"] == 200


def test_a_name_elsewhere_for_this_computer_is_refused() -> None:
    assert ask(LOCAL, host="evil.example:8080")[0]["status"] == 403


@pytest.mark.parametrize("access", [LOCAL, REMOTE])
def test_a_foreign_site_cannot_use_the_page(access: Access) -> None:
    path = "/?token=secret"
    origin = "http://evil.example"
    assert ask(access, path, host="localhost:8080", origin=origin)[0]["status"] == 403
    closed = ask(access, path, kind="websocket", host="localhost:8080", origin=origin)
    assert closed[0]["type"] == "websocket.close"


def test_another_computer_needs_the_token_once() -> None:
    host = "192.168.1.5:8080"
    assert ask(REMOTE, host=host)[0]["status"] == 401
    assert ask(REMOTE, "/?token=wrong", host=host)[0]["status"] == 401
    answer = ask(REMOTE, "/?token=secret", host=host)[0]
    assert answer["status"] == 200
    cookie = dict(answer["headers"])[b"set-cookie"].decode().partition(";")[0]
    assert ask(REMOTE, host=host, cookie=cookie)[0]["status"] == 200
    assert ask(REMOTE, host=host, cookie="twbr_token=wrong")[0]["status"] == 401


def test_a_socket_without_the_token_is_closed() -> None:
    (answer,) = ask(REMOTE, "/stream/0", kind="websocket", host="192.168.1.5:8080")
    assert answer["type"] == "websocket.close"


def test_odd_headers_are_no_error() -> None:
    assert ask(REMOTE, host="[", cookie="\x00=;;")[0]["status"] in (401, 403)
