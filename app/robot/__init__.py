"""From actions to motion: the robot node and what it is made of."""
