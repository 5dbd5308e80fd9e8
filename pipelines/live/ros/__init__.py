"""The ROS interface: messages, transforms, parameters, processes."""
