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


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Workers (``-n``) are given whole modules, whose fixtures are made once then, the longest first.

    What is measured by the clock, in the group ``live``, never runs beside another such test.
    """
    for item in items:
        if item.get_closest_marker("xdist_group") is None:
            item.add_marker(pytest.mark.xdist_group(item.nodeid.split("::")[0]))
    items.sort(key=_turn)


def _turn(item: pytest.Item) -> int:
    marker = item.get_closest_marker("xdist_group")
    if marker is not None and marker.args == ("live",):
        return 0
    return 1 if item.nodeid.startswith(("tests/end_to_end/", "tests/simulated/", "tests/pipelines/")) else 2
