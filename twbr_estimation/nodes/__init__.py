"""The ROS 2 shell: one file a node, with the scaffolding they share.

`rclpy` is imported here and in `launch/` only.
"""

from __future__ import annotations

import sys

from ..starting import start_node

# `python -m` with a node: while Python imports its package, sys.argv[0] is still "-m".
if sys.argv[:1] == ["-m"] and sys.orig_argv[-len(sys.argv)].startswith(f"{__name__}."):
    start_node()
