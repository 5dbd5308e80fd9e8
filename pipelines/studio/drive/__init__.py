"""Driving a simulated car towards clicked goals: to watch the localizer, or to discover a floor."""
