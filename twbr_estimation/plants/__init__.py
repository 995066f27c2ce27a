"""Models of two-wheeled balancing robots, one paper a file."""
