"""The estimate aligned with the walls, and where their surface lies."""
