"""Clocks of sensors: one time line, also where stamps jump, stand still or disagree."""
