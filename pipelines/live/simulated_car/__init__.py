"""The simulated car's ROS interface: its topics, its commands, and the frames of goals."""
