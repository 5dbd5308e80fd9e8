"""What tests of several rooms share."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of real recordings, beside the clone or named by RACECAR_DATA; skips when there is none."""
    beside_clone = Path(__file__).parents[2] / "shared" / "data"
    folder = Path(os.environ.get("RACECAR_DATA", beside_clone))
    if not folder.is_dir():
        pytest.skip(f"no recordings at {folder}")
    return folder
