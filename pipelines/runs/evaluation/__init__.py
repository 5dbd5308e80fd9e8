"""Measure the accuracy of trajectories."""
