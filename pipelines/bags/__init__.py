"""Bags read, checked and written."""
