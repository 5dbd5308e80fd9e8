"""Map a bag on the page, and watch the map grow."""
