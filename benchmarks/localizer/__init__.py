"""How fast the localizer is."""
