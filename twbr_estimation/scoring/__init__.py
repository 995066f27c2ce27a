"""Errors of estimates against a reference: figures, tables and plausibility checks."""
