"""Folder for the persistent state of a user's programs."""

import os
from pathlib import Path


def state_folder() -> Path:
    """Folder of this program, which may not exist. Raises RuntimeError if the user has no home."""
    home = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(home) / "racecar"
