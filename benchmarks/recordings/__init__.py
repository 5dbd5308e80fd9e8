"""The localizer's accuracy on real recordings."""
