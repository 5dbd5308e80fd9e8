"""The common ground: poses, scans, odometry, occupancy grids and their files, ray casting."""
