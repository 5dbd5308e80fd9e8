"""Where the recordings lie that are measured on."""

import os
from pathlib import Path

import racecar


def recordings_folder() -> Path:
    """Where recordings are looked for: named by RACECAR_DATA, else ``shared/data`` beside the project."""
    beside_project = Path(racecar.__file__).parents[2] / "shared" / "data"
    return Path(os.environ.get("RACECAR_DATA", beside_project))
