"""Who can reach the page, and which messages are accepted."""
