"""The estimate aligned with the walls."""
