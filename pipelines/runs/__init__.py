"""Whole runs: a bag to a map, a bag and a map to poses, and what they share."""
