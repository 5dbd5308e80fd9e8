"""The car's motion between scans: odometry, its systematic errors and its noise."""
