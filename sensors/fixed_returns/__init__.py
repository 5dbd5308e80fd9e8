"""Returns that do not belong to the world: they move along with the laser."""
