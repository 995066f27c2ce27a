"""From tilt and wheel messages to motor commands."""
