"""The verdict on a finished map: how far it may be off, why, and where."""
