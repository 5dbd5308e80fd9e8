"""Sessions: what is kept of a drive, and how another drive extends it."""
