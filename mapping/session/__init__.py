"""What is kept of a drive, and how another drive carries it on."""
