"""How accurate the localizer is on simulated drives."""
