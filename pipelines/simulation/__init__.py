"""A simulated car that drives a map by itself."""
