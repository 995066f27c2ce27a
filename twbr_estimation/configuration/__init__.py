"""Configuration files: ROS parameter files to values and back, presets, provenance."""
