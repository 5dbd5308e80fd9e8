"""What each mechanism of the localizer is good for: the same drives with one, or a group of them, off."""
