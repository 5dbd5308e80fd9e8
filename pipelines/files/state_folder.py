"""Where a user's programs keep what outlives them."""

import os
from pathlib import Path


def state_folder() -> Path:
    """The folder of this program, which need not exist. Raises RuntimeError for a user without a home."""
    home = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(home) / "racecar"
