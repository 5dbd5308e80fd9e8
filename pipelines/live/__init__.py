"""ROS 2 nodes that run on the car: sensor messages in, poses and maps out."""
