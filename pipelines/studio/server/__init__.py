"""Who reaches the page, and what is heard of them."""
