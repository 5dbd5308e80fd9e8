"""Conversion of ROS messages to scans, odometry and sensor poses."""
