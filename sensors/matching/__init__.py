"""Scan matching: point-to-line, correlative, and the tests of a match.

Long inner loops stand in files of their own, ``*_kernels.py``: numba's cache belongs to a file, and a change
anywhere in it compiles all its loops anew, which takes up to ten seconds.
"""
