"""The pose graph: constraints between keyframes, and the optimizer."""
