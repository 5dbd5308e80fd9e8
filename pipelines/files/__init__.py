"""Files of results and settings."""
