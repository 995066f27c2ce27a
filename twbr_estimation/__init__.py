"""Tilt estimation for two-wheeled balancing robots."""

__version__ = "0.1.0"
