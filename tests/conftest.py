"""What tests of several rooms share."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

settings.register_profile("racecar", deadline=None)  # the first example may compile a kernel
settings.register_profile("racecar-ci", deadline=None, derandomize=True)  # the same verdict for the same code
settings.load_profile("racecar-ci" if os.environ.get("CI") else "racecar")


@pytest.fixture(scope="session", autouse=True)
def _state_of_their_own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What programs keep is not kept beside that of whoever runs the tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of real recordings, beside the clone or named by RACECAR_DATA; skips when there is none."""
    beside_clone = Path(__file__).parents[2] / "shared" / "data"
    folder = Path(os.environ.get("RACECAR_DATA", beside_clone))
    if not folder.is_dir():
        pytest.skip(f"no recordings at {folder}")
    return folder


@pytest.fixture(scope="session")
def has_ros() -> None:
    """Skips where there is no ROS 2: none was sourced, and PyPI has none for this Python or machine."""
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        pytest.skip(f"no ROS 2 here, so no live tests: {error}")


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """One browser for all tests: each takes seconds to start, and a process may drive only one."""
    from tests.pipelines.studio.chromium import browser

    with browser() as started:
        yield started


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes long comes first, so that no worker (``-n 2``) is left with it in the end."""
    items.sort(key=lambda item: _is_live(item.nodeid) + item.nodeid.startswith(_LONG), reverse=True)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """A worker is given whole modules, whose fixtures are made once then.

    Those that are measured by the clock go to one worker, so that they do not take time from one another.
    """
    from xdist.scheduler import LoadScopeScheduling

    class ByModule(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return "live" if _is_live(nodeid) else nodeid.split("::")[0]

    return ByModule(config, log)


_LONG = ("tests/end_to_end/", "tests/simulated/", "tests/pipelines/")


def _is_live(nodeid: str) -> bool:
    return nodeid.startswith(("tests/pipelines/live/test_simulated_world", "tests/end_to_end/test_live_"))
