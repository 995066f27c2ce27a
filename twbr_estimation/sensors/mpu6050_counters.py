"""Counters of an MPU6050's reader."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Counters:
    """Events since the start; kept when the bus is closed and opened again."""

    samples: int = 0
    bus_errors: int = 0
    failed_polls: int = 0
    """Polls that gave no sample although the transfer was retried."""
    invalid_packets: int = 0
    """Packets of zeros or ones, as of a chip asleep or a bus let go; dropped."""
    repeated_packets: int = 0
    """Packets equal to several before them; dropped."""
    torn_reads: int = 0
    """Reads that a second read did not confirm."""
    reinitialisations: int = 0
    lost_settings: int = 0
    """Times the chip was found without its settings, as after a brown-out."""
    frozen: int = 0
    """Times the same sample came again and again."""
    stuck_words: int = 0
    """Axes found at one value while the chip went on sampling, full scale included."""
    silences: int = 0
    fifo_overflows: int = 0
    fifo_resynchronisations: int = 0
    """Times the FIFO was emptied: after an overflow, a broken transfer, or out of step."""
    clock_jumps: int = 0
