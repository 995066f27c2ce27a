"""The ROS 2 shell: one file a node, with the scaffolding they share.

`rclpy` is imported here and in `launch/` only.
"""

from __future__ import annotations

import gc
import re
import signal
import sys
from collections.abc import Sequence

from ..starting import start_quickly

_COMMAND = re.compile(r"(.*/)?\w+_node|.*\btwbr_estimation\.nodes\.\w+.*", re.DOTALL)


def is_command(command_line: Sequence[str]) -> bool:
    """Whether a process was started as a node: by its command, `python -m` or its launcher."""
    return any(_COMMAND.fullmatch(each) for each in command_line[1:3])


USUAL_GARBAGE = gc.get_threshold()
"""What `start_quickly` changes, to be set again once the nodes run."""

if is_command(sys.orig_argv):
    start_quickly()
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        # Ctrl-C while the modules of a node are still imported ends it without a traceback.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
