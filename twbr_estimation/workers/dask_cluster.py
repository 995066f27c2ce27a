"""Workers of an existing Dask cluster: the same units, on other machines."""

from __future__ import annotations

import queue
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import chain, islice
from typing import Any
from uuid import uuid4

from ..errors import WorkerError
from .base import Outcomes, Report, UnitResult, Work

CONNECT_TIMEOUT = 10.0
"""Longest wait for the scheduler at the start [s]."""
PATIENCE = 120.0
"""Longest wait for a scheduler or workers that are gone on the way [s]."""
ATTEMPTS = 3
"""How often in a row all that is under way may be lost."""
_WAITING = 2  # units a thread of the cluster, one at work and one ready
_LOOK = 1.0  # [s] between two looks at whether the scheduler is still there
_CONCLUDED = ("finished", "error")


class DaskCluster:
    """Does units of work on the workers of a Dask scheduler.

    Each result is fetched as soon as it is there, so a worker that dies later takes nothing
    with it; the unit it was working on is done by another one. What is under way when the
    scheduler itself is restarted is handed to it once more. The workers need this package.
    """

    def __init__(self, address: str) -> None:
        """Connect to the scheduler at `address`, as in `tcp://host:8786`.

        Raises:
            WorkerError: `distributed` is not installed, or no scheduler answers.
        """
        try:
            import distributed
        except ImportError:
            raise WorkerError(
                "Dask is not installed; pip install 'twbr_estimation[dask]'"
            ) from None
        self._address = address
        self._distributed: Any = distributed
        self._client: Any = self._connected(CONNECT_TIMEOUT)

    def close(self) -> None:
        """Leave the cluster, which goes on."""
        self._client.close()

    def run(self, work: Work, units: Iterable[Any], report: Report) -> Outcomes:
        """As `Workers`."""
        source, left = iter(units), list[Any]()
        in_vain = 0
        while in_vain < ATTEMPTS:
            lost: list[Any] = []
            in_vain += 1
            for outcome in self._attempt(work, chain(left, source), report, lost):
                in_vain = 0
                yield outcome
            if not lost:
                return
            left = lost
            self._wait_for_workers()
        raise WorkerError(
            f"the workers of the cluster at {self._address} were lost {ATTEMPTS} times in a row"
        )

    def _attempt(
        self, work: Work, source: Iterator[Any], report: Report, lost: list[Any]
    ) -> Outcomes:
        """Yield what is done; what is lost with all its workers or the scheduler is in `lost`."""
        events: queue.SimpleQueue[Any] = queue.SimpleQueue()
        topic = f"twbr-{uuid4()}"
        client = self._client
        client.subscribe_topic(topic, lambda event: events.put(event[1]))
        shared = client.scatter(work.shared, broadcast=True, hash=False)
        pending: dict[Any, Any] = {}
        number = 0
        try:
            while not lost:
                for unit in islice(source, max(0, self._room() - len(pending))):
                    number += 1
                    key = f"{topic}-{number}-{unit!s:.80}"
                    future = client.submit(run_unit, work.function, shared, unit, topic, key=key)
                    pending[future] = unit
                    future.add_done_callback(events.put)
                if not pending:
                    return
                yield from self._concluded(events, pending, report, lost)
            lost += pending.values()
        finally:
            if client.status == "running":
                client.cancel(list(pending))
                client.unsubscribe_topic(topic)

    def _concluded(
        self, events: Any, pending: dict[Any, Any], report: Report, lost: list[Any]
    ) -> Outcomes:
        """Wait for the next event and yield the outcome where it is one."""
        try:
            event = events.get(timeout=_LOOK)
        except queue.Empty:
            if self._client.status != "running":
                lost += pending.values()
                pending.clear()
            return
        if not isinstance(event, self._distributed.Future):
            report(event)
            return
        unit = pending.pop(event)
        try:
            if event.status in _CONCLUDED:
                yield UnitResult(unit, event.result())
            else:
                lost.append(unit)
        except self._distributed.KilledWorker:
            yield UnitResult(unit, lost="the workers that had it died each time; out of memory?")
        except (self._distributed.CancelledError, OSError):
            lost.append(unit)
        finally:
            event.release()  # else the cluster does it again when this worker dies later

    def _room(self) -> int:
        """Return how many units the cluster may have at a time."""
        threads = sum(self._client.nthreads().values()) if self._client.status == "running" else 0
        return int(_WAITING * max(threads, 1))

    def _wait_for_workers(self) -> None:
        """Wait for a worker; where the scheduler is gone, connect again."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            try:
                if self._client.status != "running":
                    self._client = self._connected(CONNECT_TIMEOUT)
                self._client.wait_for_workers(1, timeout=CONNECT_TIMEOUT)
                return
            except (TimeoutError, OSError, WorkerError):
                self._leave()
        raise WorkerError(
            f"the cluster at {self._address} has had no worker for {PATIENCE:g} s"
        ) from None

    def _leave(self) -> None:
        with suppress(TimeoutError, OSError):  # the scheduler may be gone and not answer
            self._client.close(timeout=1.0)

    def _connected(self, timeout: float) -> Any:
        try:
            return self._distributed.Client(self._address, timeout=timeout, set_as_default=False)
        except (OSError, ValueError) as error:
            raise WorkerError(f"no Dask scheduler answers at {self._address}: {error}") from None


def run_unit(function: Any, shared: Any, unit: Any, topic: str) -> Any:
    """Do one unit on a worker; its messages reach the client under `topic`."""
    return function(shared, unit, _TopicChannel(topic))


class _TopicChannel:
    """Channel of a unit on a worker of the cluster."""

    def __init__(self, topic: str) -> None:
        from distributed import get_worker

        self._topic = topic
        self._worker = get_worker()

    def send(self, message: Any) -> None:
        self._worker.log_event(self._topic, message)

    def require_wanted(self) -> None:
        pass
