"""Edits of a map, drawn by clicks."""
