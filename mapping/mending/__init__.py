"""Correct a map by hand: manual constraints are added to its pose graph, which is optimized again."""
