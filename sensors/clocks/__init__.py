"""Sensor clocks on one common timeline, even where stamps jump, stand still or disagree."""
