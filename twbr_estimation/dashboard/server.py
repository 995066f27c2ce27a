"""Serve the page: pictures over web sockets while a page is open, everything else by NiceGUI."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import ConfigurationError, TwbrError
from .access import Access, is_loopback
from .addresses import reachable
from .source import Source

STATIC = Path(__file__).parent / "static"
RECONNECT_TIMEOUT = 30.0
"""A page whose connection was lost for less goes on; after more it is loaded anew [s]."""


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

    def addresses(self) -> list[str]:
        """Return what to open in a browser, on another computer where one may look."""
        query = f"?token={self.token}" if self.token else ""
        hosts = [f"[{each}]" if ":" in each else each for each in reachable(self.host)]
        return [f"http://{host}:{self.port}/{query}" for host in hosts]


def serve(
    sources: Sequence[Source],
    settings: ServerSettings,
    started: Callable[[str], None] = lambda addresses: None,
) -> None:
    """Serve the page until the process is asked to stop.

    Args:
        sources: What to show; each gets a tab where there are several.
        settings: From `ServerSettings.secured`.
        started: Called with the addresses, joined by "or", once the page can be opened.

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
    from .pictures import Pictures

    _require_free(settings)
    pictures = [Pictures(source, settings.read_only) for source in sources]

    async def stream(socket: Any) -> None:
        index = socket.path_params["index"]
        if index < len(pictures):
            await pictures[index].serve(socket)

    app.router.routes.insert(0, WebSocketRoute("/stream/{index:int}", stream))
    app.add_static_files("/dashboard", STATIC)
    app.add_middleware(Access, token=settings.token, loopback=is_loopback(settings.host))

    async def announce() -> None:
        await _accepting(settings)
        started(" or ".join(settings.addresses()))

    app.on_startup(announce)

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
        reconnect_timeout=RECONNECT_TIMEOUT,
        binding_refresh_interval=60.0,  # nothing is bound
        ws_per_message_deflate=False,  # costs more than it saves on small messages
    )


async def _accepting(settings: ServerSettings) -> None:
    """Wait until the server takes connections, which is a moment after it has started."""
    import asyncio

    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(settings.host, settings.host)
    while True:
        try:
            _, writer = await asyncio.open_connection(host, settings.port)
        except OSError:
            await asyncio.sleep(0.05)
        else:
            writer.close()
            return


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
