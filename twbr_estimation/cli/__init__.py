"""The command line: `main` and one verb a file."""
