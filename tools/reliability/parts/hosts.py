"""Two hosts and a cable.

The sensors and motors of a robot are on one host, all other nodes on another; both are network
namespaces with a link between them, which is cut for 5 s while the robot balances.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from reliability.parts.motors import FIRST_ZEROS
from reliability.row import Effort, Row, Skipped

PROGRAM = Path(__file__).resolve().parents[1] / "two_hosts.py"
CUTS = 10
BACK = 2.0
"""Time in which the tilt has to come again [s]."""
SILENT = 0.5
"""Time after a cut in which the last tilt comes [s]; later ones are of no reading."""
LIMIT = 900.0
"""Time for all cuts [s]."""


def rows(effort: Effort) -> Iterator[Row]:
    """Cut the link again and again.

    Raises:
        Skipped: this user may have no network of his own.
    """
    if not permitted():
        raise Skipped("needs `ip` of iproute2, and namespaces: `unshare -rn ip link` must work")
    cuts = effort.tries(CUTS)
    command = ["unshare", "-rn", sys.executable, str(PROGRAM), str(cuts)]
    done = subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE, timeout=LIMIT)
    found = json.loads(done.stdout.splitlines()[-1])
    driving, zeros = max(e["driving"] for e in found), min(e["zeros"] for e in found)
    back, valid = max(e["back"] for e in found), max(e["valid_again"] for e in found)
    wrong, compared = sum(e["wrong"] for e in found), sum(e["compared"] for e in found)
    silent = max(e["silent"] for e in found)
    yield Row(
        "the link between two hosts cut for 5 s",
        len(found),
        f"at most {FIRST_ZEROS} commands that drive after the last tilt, then zeros; tilts again "
        f"within {BACK:g} s, none valid and wrong by 3 deg",
        f"last tilt {silent:.2f} s after the cut, then at most {driving} that drive and at least "
        f"{zeros} of zeros; tilts after at most {back:.2f} s, valid after at most {valid:.2f} s; "
        f"{wrong} of {compared} wrong",
        silent < SILENT
        and driving <= FIRST_ZEROS
        and zeros > 0
        and back <= BACK
        and wrong == 0
        and compared > 0
        and math.isfinite(valid),
    )


def permitted() -> bool:
    """Return whether this user may have a network of his own."""
    if shutil.which("ip") is None or shutil.which("unshare") is None:
        return False
    tried = [
        "unshare",
        "-rn",
        "ip",
        "link",
        "add",
        "twbr0",
        "type",
        "veth",
        "peer",
        "name",
        "twbr1",
    ]
    return subprocess.run(tried, capture_output=True, check=False).returncode == 0
