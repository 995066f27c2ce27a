"""Parts of the inertial navigation filter `ins_odometer`."""
