"""Reading, checking and writing bags."""
