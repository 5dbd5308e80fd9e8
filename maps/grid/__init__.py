"""Occupancy grids: distances to walls and ray casting."""
