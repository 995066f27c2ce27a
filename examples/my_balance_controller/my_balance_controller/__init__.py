"""Balance controllers to copy."""
