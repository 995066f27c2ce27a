"""Errors of one robot's sensors, and its geometry, from recordings."""
