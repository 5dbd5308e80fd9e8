"""The simulated car's side of ROS: what it publishes, who drives it, and in which frames goals are meant."""
