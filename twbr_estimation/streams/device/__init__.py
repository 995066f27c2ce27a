"""Samples of a microcontroller: its clock, and its messages on a serial port."""
