"""Mapping of simulated worlds, each with a fault that recordings have, compared with the truth."""
