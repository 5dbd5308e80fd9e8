"""From scans and odometry to an occupancy map: odometry, constraints, loop closure, pose graph."""
