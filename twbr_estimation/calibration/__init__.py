"""What is wrong with one robot's sensors and what its geometry is, from recordings."""
