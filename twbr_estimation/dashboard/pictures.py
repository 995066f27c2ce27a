"""Pictures of one source to every browser that looks, over web sockets of their own."""

from __future__ import annotations

import asyncio
import json
import logging
import math
from contextlib import suppress
from typing import Any

from .driving import Driver
from .source import Source
from .telemetry import merged

PICTURES = 30.0
"""Pictures a second."""
EMPTY = 30
"""One in so many pictures is sent although nothing has arrived: the connection is seen to last."""
LARGEST_DELAY = 10.0
"""A browser that has not taken what came in this time is left [s]."""
LOG = logging.getLogger(__name__)


class Pictures:
    """Sends the frames of one source to every browser that looks at it."""

    def __init__(self, source: Source, read_only: bool = False) -> None:
        """Serve `source`; it is opened with the first browser and closed after the last."""
        self._source, self._read_only = source, read_only
        self._viewers: set[Viewer] = set()
        self._task: asyncio.Task[None] | None = None
        self._driver: Driver | None = None
        self._complaints: set[str] = set()

    async def serve(self, socket: Any) -> None:
        """Stay with one browser until it leaves."""
        await socket.accept()
        viewer = Viewer(socket)
        listening = asyncio.create_task(self._listen(viewer))
        try:
            self._come(viewer)
            await asyncio.wait((viewer.sending, listening), return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._leave(viewer)
            viewer.sending.cancel()
            listening.cancel()

    async def _listen(self, viewer: Viewer) -> None:
        """Take what a browser asks for; this ends with the browser."""
        loop = asyncio.get_running_loop()
        if self._driver is None:
            self._driver = Driver(self._source.drive, loop.call_later)
        with suppress(Exception):
            while True:
                self._take(viewer, await viewer.socket.receive_text())

    def _take(self, viewer: Viewer, text: str) -> None:
        """Take a message of a browser: `{"drive": [forward, left]}` or `{"show": [traces]}`."""
        try:
            message = json.loads(text)
        except (ValueError, RecursionError):
            return
        if not isinstance(message, dict):
            return
        if "drive" in message and self._driver is not None and not self._read_only:
            self._driver.take(viewer, message["drive"])
        if isinstance(message.get("show"), list):
            viewer.shows = {each for each in self._source.on_request if each in message["show"]}
            self._want()

    def _want(self) -> None:
        self._source.want(set().union(*(viewer.shows for viewer in self._viewers)))

    def _come(self, viewer: Viewer) -> None:
        if not self._viewers:
            self._source.open()
        viewer.offer(self._source.telemetry.history())
        self._viewers.add(viewer)
        if self._task is None or self._task.done():
            self._task = asyncio.create_task(self._send())

    def _leave(self, viewer: Viewer) -> None:
        if self._driver is not None:
            self._driver.leave(viewer)
        self._viewers.discard(viewer)
        self._want()
        if not self._viewers:
            self._source.close()

    async def _send(self) -> None:
        """Poll and offer pictures as long as a page is open; empty ones where nothing arrives."""
        loop = asyncio.get_running_loop()
        due, empty = loop.time(), 0
        while self._viewers:
            try:
                self._source.poll()
                frame = self._source.telemetry.frame()
                empty = 0 if frame["traces"] or frame.get("reset") else empty + 1
                if empty % EMPTY == 0:
                    for viewer in self._viewers:
                        viewer.offer(frame)
            except Exception as error:  # the next picture must come in any case
                self._complain(error)
            due = max(due + 1.0 / PICTURES, loop.time())
            await asyncio.sleep(due - loop.time())

    def _complain(self, error: Exception) -> None:
        text = f"{type(error).__name__}: {error}"
        if text not in self._complaints and len(self._complaints) < 20:
            self._complaints.add(text)
            LOG.warning("%s: a picture is left out: %s", self._source.name, text)


class Viewer:
    """One browser: what it has not been sent yet, joined into one picture when it is slow."""

    def __init__(self, socket: Any) -> None:
        """Begin to send to `socket`."""
        self.socket = socket
        self.shows: set[str] = set()
        """Traces on request that are shown."""
        self._frames: list[dict[str, Any]] = []
        self._arrived = asyncio.Event()
        self._at = 0.0
        """When the newest picture was made, by a clock that only the differences count of [s]."""
        self.sending = asyncio.create_task(self._send())
        """Ends when the browser has left, or has taken nothing for `LARGEST_DELAY`."""

    def offer(self, frame: dict[str, Any]) -> None:
        """Take a picture to send."""
        self._frames.append(frame)
        self._at = round(asyncio.get_running_loop().time(), 3)
        self._arrived.set()
        if len(self._frames) > LARGEST_DELAY * PICTURES:
            self.sending.cancel()

    async def _send(self) -> None:
        with suppress(Exception):
            while True:
                await self._arrived.wait()
                self._arrived.clear()
                frames, self._frames = self._frames, []
                frame = frames[0] if len(frames) == 1 else merged(frames)
                await self.socket.send_text(text_of({**frame, "at": self._at}))


def text_of(frame: dict[str, Any]) -> str:
    """Return a picture as JSON, null in the place of what is not finite."""
    try:
        return json.dumps(frame, separators=(",", ":"), allow_nan=False)
    except ValueError:
        return json.dumps(_finite(frame), separators=(",", ":"))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
