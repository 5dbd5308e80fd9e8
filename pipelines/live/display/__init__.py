"""What nodes show to people, in RViz and in the browser."""
