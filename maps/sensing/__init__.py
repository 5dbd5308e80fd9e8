"""What sensors tell: scans, clouds, odometry."""
