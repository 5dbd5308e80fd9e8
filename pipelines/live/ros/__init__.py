"""What speaks ROS: messages, transforms, parameters, processes."""
