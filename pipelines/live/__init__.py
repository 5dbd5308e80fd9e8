"""The nodes that run on the car: ROS 2 messages in, poses and maps out."""
