"""The laser's motion from scan to scan: wheels, scan odometry, deskewing."""
