"""Whole runs: mapping a bag, localizing a bag on a map, and what these share."""
