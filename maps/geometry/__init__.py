"""Poses in the plane."""
