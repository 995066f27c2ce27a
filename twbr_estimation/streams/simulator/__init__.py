"""The simulated robot as a stream."""
