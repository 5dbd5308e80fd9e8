"""Render an occupancy grid from keyframes and their poses."""
