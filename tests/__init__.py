"""Tests, in folders that mirror the rooms; helper modules are imported as ``tests.<room>.<module>``."""
