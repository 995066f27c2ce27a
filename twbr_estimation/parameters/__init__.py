"""Values that a user sets, each with bounds, unit and description."""
