"""What the nodes display in RViz and in the browser."""
