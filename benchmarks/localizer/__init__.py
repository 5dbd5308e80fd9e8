"""The localizer's speed."""
