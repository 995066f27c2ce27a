"""Text of recordings, files and messages on a terminal, without its control characters."""
