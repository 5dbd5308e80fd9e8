"""How accurate the localizer is on real recordings."""
