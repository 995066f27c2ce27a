"""Cramer-Rao bound of the tilt error."""
