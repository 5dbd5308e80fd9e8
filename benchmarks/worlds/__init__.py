"""Mapping simulated worlds, each with a fault that recordings have, against the truth."""
