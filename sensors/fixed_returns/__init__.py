"""Detect returns that are fixed to the robot and not part of the world."""
