"""Sensor messages on their way to the mapper or the localizer."""
