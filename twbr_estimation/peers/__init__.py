"""Estimators of other projects beside ours, on the same recordings."""
