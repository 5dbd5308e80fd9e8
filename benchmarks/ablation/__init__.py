"""Ablation of the localizer: the same drives with one mechanism, or a group of them, off."""
