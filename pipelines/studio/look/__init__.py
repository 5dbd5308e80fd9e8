"""Look at a run: its map and path, and a time line of the drive."""
