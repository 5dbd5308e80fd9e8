"""The car's motion between scans: odometry, its faults and its noise."""
