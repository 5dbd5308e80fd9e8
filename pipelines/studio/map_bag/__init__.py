"""A bag becomes a map on the page, which one watches grow."""
