"""Serve the page: pictures over a web socket while somebody looks, everything else by NiceGUI."""

from __future__ import annotations

import asyncio
import json
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import ConfigurationError, TwbrError
from .access import Access, is_loopback
from .source import Source

PICTURES = 30.0
"""Pictures a second."""
STATIC = Path(__file__).parent / "static"


class DashboardError(TwbrError):
    """The page cannot be served."""


@dataclass(frozen=True, slots=True)
class ServerSettings:
    """Where the page is served, and what it may do."""

    host: str = "127.0.0.1"
    port: int = 8080
    token: str = ""
    """Needed by every browser; made where another address than this computer's has none."""
    read_only: bool = False
    """Whether the page only shows and changes nothing."""
    title: str = "twbr"

    def __post_init__(self) -> None:
        """Check the port.

        Raises:
            ConfigurationError: no port of TCP.
        """
        if not 1 <= self.port <= 65535:
            raise ConfigurationError(f"port {self.port} is not within 1 to 65535")

    def secured(self) -> ServerSettings:
        """Return these settings with a token where one is needed."""
        if self.token or is_loopback(self.host):
            return self
        return ServerSettings(
            self.host, self.port, secrets.token_urlsafe(12), self.read_only, self.title
        )

    def address(self) -> str:
        """Return what to open in a browser."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        query = f"?token={self.token}" if self.token else ""
        return f"http://{host}:{self.port}/{query}"


class Pictures:
    """Sends the frames of one source to every browser that looks at it."""

    def __init__(self, source: Source) -> None:
        """Serve `source`; it is opened with the first browser and closed after the last."""
        self._source = source
        self._sockets: set[Any] = set()
        self._task: asyncio.Task[None] | None = None

    async def serve(self, socket: Any) -> None:
        """Stay with one browser until it leaves."""
        await socket.accept()
        if not self._sockets:
            self._source.open()
        await socket.send_text(_text(self._source.telemetry.history()))
        self._sockets.add(socket)
        if self._task is None or self._task.done():
            self._task = asyncio.create_task(self._send())
        try:
            while True:
                await socket.receive_text()  # nothing is asked of us; this ends with the browser
        except Exception:
            self._leave(socket)

    def _leave(self, socket: Any) -> None:
        self._sockets.discard(socket)
        if not self._sockets:
            self._source.close()

    async def _send(self) -> None:
        """Poll and send until nobody looks any more."""
        loop = asyncio.get_running_loop()
        due = loop.time()
        while self._sockets:
            self._source.poll()
            frame = self._source.telemetry.frame()
            if frame["traces"] or frame.get("reset"):
                await self._send_to_all(_text(frame))
            due = max(due + 1.0 / PICTURES, loop.time())
            await asyncio.sleep(due - loop.time())

    async def _send_to_all(self, text: str) -> None:
        for socket in tuple(self._sockets):
            try:
                await asyncio.wait_for(socket.send_text(text), 1.0)
            except Exception:
                self._leave(socket)


def _text(frame: dict[str, Any]) -> str:
    return json.dumps(frame, separators=(",", ":"), allow_nan=False)


def serve(
    sources: Sequence[Source],
    settings: ServerSettings,
    started: Callable[[str], None] = lambda address: None,
) -> None:
    """Serve the page until the process is asked to stop.

    Args:
        sources: What to show; each gets a tab where there are several.
        settings: From `ServerSettings.secured`.
        started: Called with the address once the page can be opened.

    Raises:
        DashboardError: NiceGUI is missing, or the port cannot be taken.
    """
    try:
        from nicegui import app, ui
    except ImportError as error:
        raise DashboardError(
            f"the page needs NiceGUI ({error.name} is missing): "
            "pip install 'twbr_estimation[dashboard]'"
        ) from None
    from starlette.routing import WebSocketRoute

    from .page import build_page

    _require_free(settings)
    pictures = [Pictures(source) for source in sources]

    async def stream(socket: Any) -> None:
        index = socket.path_params["index"]
        if index < len(pictures):
            await pictures[index].serve(socket)

    app.router.routes.insert(0, WebSocketRoute("/stream/{index:int}", stream))
    app.add_static_files("/dashboard", STATIC)
    app.add_middleware(Access, token=settings.token, loopback=is_loopback(settings.host))
    app.on_startup(lambda: started(settings.address()))

    @ui.page("/", title=settings.title)
    def index() -> None:
        build_page(sources, settings.read_only)

    ui.run(
        host=settings.host,
        port=settings.port,
        reload=False,
        show=False,
        show_welcome_message=False,
        uvicorn_logging_level="warning",
        access_log=False,
    )


def _require_free(settings: ServerSettings) -> None:
    import socket

    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    with socket.socket(family) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((settings.host, settings.port))
        except OSError as error:
            raise DashboardError(
                f"{settings.host}:{settings.port} cannot be taken ({error.strerror}); "
                "choose another port"
            ) from None
