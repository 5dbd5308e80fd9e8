"""Keyframes and the scans between them: chosen, placed, tied together."""
