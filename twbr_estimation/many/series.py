"""One job on a series of recordings: what the table lacks is done by workers and appended.

The work is handed out in batches of about a second.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

from ..errors import TwbrError
from ..workers import UnitResult, Work, Workers
from .digests import content_of, version
from .jobs import WHOLE, Batch, Done, Job, Share, do_batch
from .results import ResultTable, Row

BATCH_SECONDS = 1.0
"""Work that a batch holds, as far as it can be estimated [s]."""
FIRST_RATE = 3e-8
"""Time of one part for each byte of a recording, before any is measured [s]."""
_MEMORY = 0.8  # weight of what was measured before in the rate


@dataclass(frozen=True, slots=True)
class Failure:
    """A recording, or a part of one, without a result."""

    place: str
    part: str
    reason: str

    def __str__(self) -> str:
        """Return a line that names the recording and the reason."""
        reason = self.reason.removeprefix(f"{self.place}: ")
        return f"{self.place}: {self.part}{': ' if self.part else ''}{reason}"


@dataclass(frozen=True, slots=True)
class Progress:
    """How far the work is."""

    recordings: int
    done: int
    """Recordings done, those that were in the table included."""
    known: int
    """Recordings of which all was in the table."""
    found: int
    """Parts that were in the table."""
    computed: int
    """Parts computed now."""
    failed: int
    """Recordings that failed."""
    elapsed: float
    """Time since the start [s]."""

    @property
    def rate(self) -> float:
        """Recordings a second, of those that were not known; 0 before the first."""
        return (self.done - self.known) / self.elapsed if self.elapsed > 0.0 else 0.0

    @property
    def remaining(self) -> float | None:
        """Time that is left at this rate [s]; None before the first recording."""
        return (self.recordings - self.done) / self.rate if self.rate > 0.0 else None


Report = Callable[[Progress], None]


def run(
    job: Job,
    places: Sequence[str],
    workers: Workers,
    table: ResultTable,
    report: Report = lambda progress: None,
    prepare: Callable[[], None] = lambda: None,
) -> Series:
    """Do a job with recordings, but for what the table holds.

    Ctrl-C ends it; what was done until then is in the table.

    Args:
        job: what is done.
        places: recordings, from `recordings_at`.
        workers: who does it.
        table: what is done already; it grows.
        report: called as it goes on.
        prepare: called once, before anything is computed.

    Raises:
        TwbrError: the workers fail, or the table cannot be written.
    """
    series = Series(job, places, table, report)
    batches: Iterable[Batch] = series.batches(prepare)
    while batches:
        work = Work(do_batch, job)
        with closing(workers.run(work, batches, lambda message: None)) as outcomes:
            for outcome in outcomes:
                series.take(outcome)
        batches = series.suspects()
    return series


class Series:
    """The state of a job on many recordings, and its results."""

    def __init__(self, job: Job, places: Sequence[str], table: ResultTable, report: Report) -> None:
        """Begin without looking at any recording; `run` makes it."""
        self.places = tuple(places)
        self._job, self._table, self._report = job, table, report
        self._contents: list[str] = []
        self._reasons: dict[str, dict[str, tuple[str, str]]] = {}  # and whose they are
        self._left: dict[int, int] = {}
        self._suspects: list[Share] = []
        self._begun: dict[str, int] = {}
        self._rate = FIRST_RATE
        self._found = self._computed = self._done = self._skipped = 0
        self._start = time.monotonic()

    def results(self, number: int) -> dict[str, Mapping[str, Any]]:
        """Return the results of a recording by part; parts that failed are missing."""
        found = {}
        content = self._contents[number]
        for part in self._job.parts:
            key = self._key(content, part)
            if content and key in self._table:
                row = self._table.row(key)
                if row["result"] is not None:
                    found[part] = _renamed(row["result"], row["source"], self.places[number])
        return found

    def failures(self) -> list[Failure]:
        """Return what failed, in the order of the recordings."""
        found = []
        for number, place in enumerate(self.places):
            reasons = self._reasons.get(self._identity(number), {})
            if WHOLE in reasons:
                reasons = {WHOLE: reasons[WHOLE]}
            elif len(reasons) == len(self._job.parts) - 1 > 0:  # all filters for one reason
                reasons = {WHOLE: next(iter(reasons.values()))}
            found += [
                Failure(place, part, reason.replace(source, place))
                for part, (reason, source) in reasons.items()
            ]
        return found

    def batches(self, prepare: Callable[[], None]) -> Iterator[Batch]:
        """Yield what is to be done, in batches of about `BATCH_SECONDS`."""
        shares: list[Share] = []
        cost, prepared = 0.0, False
        for number in range(len(self.places)):
            share = self._missing(number)
            while share is not None:
                if not prepared:
                    prepare()
                    prepared = True
                room = int((BATCH_SECONDS - cost) / (self._rate * max(share.size, 1)))
                if shares and room < len(share.parts):
                    yield Batch(tuple(shares))
                    shares, cost = [], 0.0
                    continue
                fits = max(1, room)
                now, later = share.parts[:fits], share.parts[fits:]
                shares.append(Share(number, share.place, share.content, share.size, now))
                cost += self._rate * share.size * len(now)
                share = Share(number, share.place, share.content, share.size, later)
                share = share if later else None
        if shares:
            yield Batch(tuple(shares))

    def suspects(self) -> list[Batch]:
        """Return the recordings of batches that were lost, each alone, to be tried once more."""
        found, self._suspects = [Batch((share,)) for share in self._suspects], []
        return found

    def _missing(self, number: int) -> Share | None:
        """Return what is to be done with a recording; None where all is known."""
        place = self.places[number]
        try:
            content, size = content_of(place)
        except TwbrError as error:
            self._contents.append("")
            share = Share(number, place, "", 0, ())
            self._append([Done(share, WHOLE, None, str(error), final=False)])
            self._skip()
            return None
        self._contents.append(content)
        parts = tuple(part for part in self._job.parts if not self._known(content, part))
        if content in self._begun or WHOLE in self._reasons.get(content, {}) or not parts:
            self._found += len(self._job.parts)
            self._skip()
            return None
        self._found += len(self._job.parts) - len(parts)
        self._begun[content] = number
        self._left[number] = len(parts)
        return Share(number, place, content, size, parts)

    def _known(self, content: str, part: str) -> bool:
        key = self._key(content, part)
        if key not in self._table:
            return False
        row = self._table.row(key)
        if row["error"] is not None:
            self._reasons.setdefault(content, {})[part] = row["error"], row["source"]
            return True
        return self._job.is_there(row["result"])

    def take(self, outcome: UnitResult) -> None:
        """Append what a worker has done."""
        batch: Batch = outcome.unit
        if outcome.lost and len(batch.shares) > 1:  # one of them killed its worker
            self._suspects += batch.shares
            return
        found: list[Done] = outcome.result or [
            Done(share, part, None, outcome.lost, final=False)
            for share in batch.shares
            for part in share.parts
        ]
        self._append(found)
        cost = sum(share.size * len(share.parts) for share in batch.shares)
        if cost > 0 and not outcome.lost:
            measured = sum(each.seconds for each in found) / cost
            self._rate = _MEMORY * self._rate + (1.0 - _MEMORY) * measured
        for share in batch.shares:
            self._computed += len(share.parts)
            self._left[share.number] -= len(share.parts)
            if self._left[share.number] == 0:
                del self._left[share.number]
                self._done += 1
        self._report(self._progress())

    def _append(self, found: Sequence[Done]) -> None:
        for each in found:
            if each.error is not None:
                identity = self._identity(each.share.number)
                self._reasons.setdefault(identity, {})[each.part] = each.error, each.share.place
        self._table.append([self._row(each) for each in found])

    def _row(self, done: Done) -> Row:
        content = done.share.content
        return {
            "key": self._key(content, done.part) if content and done.final else "",
            "verb": self._job.verb,
            "source": done.share.place,
            "recording": content,
            "filter": done.part,
            "settings": _digest(self._job.settings(done.part)),
            "version": version(),
            "seconds": round(done.seconds, 6),
            "error": done.error,
            "result": done.result,
        }

    def _key(self, content: str, part: str) -> str:
        parts = (self._job.verb, content, part, self._job.settings(part), version())
        return _digest("\0".join(parts))

    def _identity(self, number: int) -> str:
        """Return the content of a recording; its number where it cannot be read."""
        return self._contents[number] or f"#{number}"

    def _skip(self) -> None:
        """Count a recording that needs no work."""
        self._done += 1
        self._skipped += 1
        self._report(self._progress())

    def _progress(self) -> Progress:
        return Progress(
            recordings=len(self.places),
            done=self._done,
            known=self._skipped,
            found=self._found,
            computed=self._computed,
            failed=len(self._reasons),
            elapsed=time.monotonic() - self._start,
        )


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()[:32]


def _renamed(result: Any, old: str, new: str) -> Any:
    """Return a result with the name of the recording that it is asked for now."""
    if old == new:
        return result
    if isinstance(result, str):
        return result.replace(old, new)
    if isinstance(result, dict):
        return {key: _renamed(value, old, new) for key, value in result.items()}
    if isinstance(result, list):
        return [_renamed(value, old, new) for value in result]
    return result
