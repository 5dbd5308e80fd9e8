"""Damaged inputs of every kind, and the rule that all of them are held to."""
