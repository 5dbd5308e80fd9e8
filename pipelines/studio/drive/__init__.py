"""Drive a simulated car to clicked goals, to watch the localizer or to map an unknown floor."""
