"""Scan matching: point-to-line, correlative, and the tests of a match."""
