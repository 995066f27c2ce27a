"""The ROS 2 shell: one file a node, with the scaffolding they share.

`rclpy` is imported here and in `launch/` only.
"""
