"""Controllers that steer: the robot's motion follows from their commands and may leave the planned path."""
