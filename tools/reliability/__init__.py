"""Tools that try to break drivers, nodes, commands and files; also for a driver of your own."""
