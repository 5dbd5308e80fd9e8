"""Messages of the sensors on their way to the mapper or the localizer."""
