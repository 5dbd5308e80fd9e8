"""Watching a car that drives somewhere else, such as before a ROS 2 node."""
