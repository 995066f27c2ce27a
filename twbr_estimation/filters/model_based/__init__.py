"""Parts of the filters that use a model of the robot's dynamics."""
