"""Looking at a run: its map and path, and a time line to go through the drive."""
