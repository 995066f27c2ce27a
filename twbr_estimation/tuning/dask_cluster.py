"""Tune on an existing Dask cluster: the units of work of `workers`, on other machines."""

from __future__ import annotations

import queue
from collections.abc import Iterator, Mapping, Sequence
from typing import Any
from uuid import uuid4

from ..errors import WorkerError
from .filter import TunedFilter, TuningTask, tune_filter
from .workers import Improvements, Report, longest_first

CONNECT_TIMEOUT = 10.0
"""Longest wait for the scheduler [s]."""
_ATTEMPTS = 3  # how often the recordings are sent anew when the workers that held them are gone
_LOST = ("cancelled", "lost")


class DaskCluster:
    """Tunes filters on the workers of a Dask scheduler.

    Each result is fetched as soon as it is there, so a worker that dies later takes nothing
    with it; the unit it was working on is done by another one. The workers need this package.
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
        self._client: Any
        self._distributed: Any = distributed
        try:
            self._client = self._distributed.Client(
                address, timeout=CONNECT_TIMEOUT, set_as_default=False
            )
        except (OSError, ValueError) as error:
            raise WorkerError(f"no Dask scheduler answers at {address}: {error}") from None

    def close(self) -> None:
        """Leave the cluster, which goes on."""
        self._client.close()

    def tune(self, task: TuningTask, names: Sequence[str], report: Report) -> Iterator[TunedFilter]:
        """As `workers.Workers`."""
        left = list(names)
        for _ in range(_ATTEMPTS):
            for tuned in self._attempt(task, left.copy(), report):
                left.remove(tuned.name)
                yield tuned
            if not left:
                return
        raise WorkerError(
            f"the cluster's workers were lost {_ATTEMPTS} times while tuning {', '.join(left)}"
        )

    def _attempt(
        self, task: TuningTask, names: Sequence[str], report: Report
    ) -> Iterator[TunedFilter]:
        """Yield what is done; leave out what was lost with all its workers."""
        events: queue.SimpleQueue[Any] = queue.SimpleQueue()
        topic = f"twbr-tune-{uuid4()}"
        self._client.subscribe_topic(topic, lambda event: events.put(event[1]))
        everywhere = self._client.scatter(task, broadcast=True, hash=False)
        pending = {
            self._client.submit(unit, everywhere, name, topic, key=f"{topic}-{name}")
            for name in longest_first(names)
        }
        for future in pending:
            future.add_done_callback(events.put)
        try:
            while pending:
                event = events.get()
                if isinstance(event, self._distributed.Future):
                    pending.remove(event)
                    yield from self._result(event)
                else:
                    report(*event)
        finally:
            self._client.cancel(list(pending))
            self._client.unsubscribe_topic(topic)

    def _result(self, future: Any) -> list[TunedFilter]:
        if future.status in _LOST:
            return []
        try:
            return [future.result()]
        except (self._distributed.KilledWorker, self._distributed.CancelledError):
            return []
        finally:
            future.release()  # else the cluster does it again when this worker dies later


def unit(task: TuningTask, name: str, topic: str) -> TunedFilter:
    """Tune one filter on a worker and report its progress to the client under `topic`."""
    from distributed import get_worker

    worker = get_worker()

    def report(name: str, figure: float, values: Mapping[str, float]) -> None:
        worker.log_event(topic, (name, figure, dict(values)))

    return tune_filter(task, name, Improvements(name, report))
