"""Errors of estimates against a reference: figures and tables."""
