"""Scan matching, point-to-line and correlative, and tests that verify a match.

Long kernels are in separate files, ``*_kernels.py``: numba caches per file, and any change to a file
recompiles all its kernels, which takes up to ten seconds.
"""
