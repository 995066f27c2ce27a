"""Tuning: parameters that make an estimate agree with the reference on recordings."""
