"""The occupancy grid rendered from keyframes and their poses."""
