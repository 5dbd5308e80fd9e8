"""Watch a car that is driven elsewhere, for example by a ROS 2 node."""
