"""Map many bags at once, and show the results on one page."""
