"""The localizer's accuracy on simulated drives."""
