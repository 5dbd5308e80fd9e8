"""What tests of several rooms share."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("racecar", deadline=None)  # the first example may compile a kernel
settings.register_profile("racecar-ci", deadline=None, derandomize=True)  # the same verdict for the same code
settings.load_profile("racecar-ci" if os.environ.get("CI") else "racecar")


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of real recordings, beside the clone or named by RACECAR_DATA; skips when there is none."""
    beside_clone = Path(__file__).parents[2] / "shared" / "data"
    folder = Path(os.environ.get("RACECAR_DATA", beside_clone))
    if not folder.is_dir():
        pytest.skip(f"no recordings at {folder}")
    return folder
