"""Keyframes and the scans between them: selection, placement, constraints."""
