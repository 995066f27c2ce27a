"""Estimators and controllers judged by balancing the simulated robot."""
