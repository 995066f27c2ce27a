"""The same job on many recordings, on as many processes or machines as there are.

`recordings_at` finds the recordings; a `Job` is what is done with each of them, in parts that do
not depend on each other (one filter each); `run` has the parts that a `ResultTable` does not hold
yet done by workers and appends them as they come.
"""

from __future__ import annotations

from .evaluation import Evaluation
from .places import recordings_at
from .results import ResultTable, open_table
from .running import Campaign, Failure, Job, Progress, Report, run

__all__ = [
    "Campaign",
    "Evaluation",
    "Failure",
    "Job",
    "Progress",
    "Report",
    "ResultTable",
    "open_table",
    "recordings_at",
    "run",
]
