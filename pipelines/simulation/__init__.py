"""A simulated car that drives through a map by itself."""
