"""Correct a map by hand: look at its doubts, preview constraints, keep those that are right."""
