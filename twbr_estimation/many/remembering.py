"""Workers that do not do again what a table of results holds."""

from __future__ import annotations

import hashlib
import pickle
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import closing
from typing import Any

from ..workers import Outcomes, UnitResult, Work, Workers
from ..workers.base import Report
from .digests import version
from .results import ResultTable


class Remembering:
    """Passes on units whose result is not in the table, and appends what is found."""

    def __init__(
        self,
        workers: Workers,
        table: ResultTable,
        verb: str,
        encode: Callable[[Any], Mapping[str, Any]],
        decode: Callable[[Mapping[str, Any]], Any],
    ) -> None:
        """Remember results of `workers`.

        Args:
            workers: who does what is not known.
            table: of results.
            verb: name of the work in the table.
            encode: a result as plain data.
            decode: the result of such data.
        """
        self._workers, self._table, self._verb = workers, table, verb
        self._encode, self._decode = encode, decode

    def run(self, work: Work, units: Iterable[Any], report: Report) -> Outcomes:
        """As `workers.Workers`; a unit is known by its name and by all that units share."""
        shared = hashlib.sha256(pickle.dumps(work.shared)).hexdigest()[:32]
        missing = []
        for unit in units:
            key = self._key(shared, unit)
            if key in self._table:
                yield UnitResult(unit, self._decode(self._table.row(key)["result"]))
            else:
                missing.append(unit)
        if not missing:
            return
        begin = time.monotonic()
        with closing(self._workers.run(work, missing, report)) as outcomes:
            for outcome in outcomes:
                if not outcome.lost:
                    self._table.append([self._row(shared, outcome, time.monotonic() - begin)])
                yield outcome

    def _row(self, shared: str, outcome: UnitResult, since: float) -> dict[str, Any]:
        return {
            "key": self._key(shared, outcome.unit),
            "verb": self._verb,
            "source": "",
            "recording": shared,
            "filter": str(outcome.unit),
            "settings": "",
            "version": version(),
            "seconds": round(since, 6),
            "error": None,
            "result": self._encode(outcome.result),
        }

    def _key(self, shared: str, unit: Any) -> str:
        text = "\0".join((self._verb, shared, str(unit), version()))
        return hashlib.sha256(text.encode()).hexdigest()[:32]
