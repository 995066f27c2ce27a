"""Who may open the page: a token for other computers, and no foreign site in any case."""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable, Mapping
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

COOKIE = "twbr_token"
LOOPBACK = ("127.0.0.1", "localhost", "::1")

Scope = Mapping[str, object]
Application = Callable[..., Awaitable[None]]


def is_loopback(host: str) -> bool:
    """Return whether an address can only be reached from this computer."""
    return host in LOOPBACK


class Access:
    """ASGI middleware: refuses requests without the token, and those of foreign sites.

    The token comes once as `?token=...` and is then kept in a cookie. Where the page is bound
    to this computer only, no token is needed, but the request's `Host` must name this computer:
    otherwise a site elsewhere could reach the page through a name of its own.
    """

    def __init__(self, application: Application, token: str, loopback: bool) -> None:
        """Wrap `application`; an empty `token` asks for none."""
        self._application = application
        self._token = token
        self._loopback = loopback

    async def __call__(self, scope: Scope, receive: object, send: object) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._application(scope, receive, send)
            return
        headers = _headers(scope)
        if not self._is_ours(headers):
            await _refuse(scope, receive, send, 403, "this page is not served to other sites")
        elif self._token and not self._knows_token(scope, headers):
            await _refuse(
                scope, receive, send, 401, "open the address with ?token=... from the node's log"
            )
        else:
            await self._application(scope, receive, self._with_cookie(scope, send))

    def _is_ours(self, headers: Mapping[str, str]) -> bool:
        host = _name_of(headers.get("host", ""))
        if self._loopback and host not in LOOPBACK:
            return False
        origin = headers.get("origin", "")
        return not origin or origin.partition("//")[2] == headers.get("host", "")

    def _knows_token(self, scope: Scope, headers: Mapping[str, str]) -> bool:
        return any(
            secrets.compare_digest(given.encode(), self._token.encode())
            for given in (_asked(scope), _kept(headers))
            if given
        )

    def _with_cookie(self, scope: Scope, send: object) -> object:
        """Return `send` that adds the cookie to the answer to a request with the token."""
        if scope["type"] != "http" or not self._token or not _asked(scope):
            return send
        cookie = f"{COOKIE}={self._token}; HttpOnly; SameSite=Strict; Path=/".encode()

        async def sending(message: dict[str, object]) -> None:
            if message["type"] == "http.response.start":
                headers = list(message.get("headers", []))  # type: ignore[call-overload]
                message = {**message, "headers": [*headers, (b"set-cookie", cookie)]}
            await send(message)  # type: ignore[operator]

        return sending


def _headers(scope: Scope) -> dict[str, str]:
    pairs: list[tuple[bytes, bytes]] = list(scope["headers"])  # type: ignore[call-overload]
    return {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in pairs}


def _name_of(host: str) -> str:
    """Return the name in a `Host` header, without the port."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:  # half an IPv6 address
        return ""


def _asked(scope: Scope) -> str:
    query = bytes(scope.get("query_string", b"")).decode("latin-1")  # type: ignore[call-overload]
    given: list[str] = parse_qs(query).get("token", [])
    return given[0] if given else ""


def _kept(headers: Mapping[str, str]) -> str:
    try:
        cookie = SimpleCookie(headers.get("cookie", ""))
    except CookieError:
        return ""
    return str(cookie[COOKIE].value) if COOKIE in cookie else ""


async def _refuse(scope: Scope, receive: object, send: object, code: int, text: str) -> None:
    if scope["type"] == "websocket":
        await receive()  # type: ignore[operator]
        await send({"type": "websocket.close", "code": 1008, "reason": text})  # type: ignore[operator]
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8")]
    await send({"type": "http.response.start", "status": code, "headers": headers})  # type: ignore[operator]
    await send({"type": "http.response.body", "body": text.encode()})  # type: ignore[operator]
