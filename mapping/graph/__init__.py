"""The pose graph: constraints between keyframes, and their solution."""
