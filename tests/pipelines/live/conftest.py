"""What nodes say over DDS is kept to this machine, and to a domain of each test module."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.ros_domains import next_domain


@pytest.fixture(scope="session", autouse=True)
def ros(has_ros: None) -> None:
    from racecar.pipelines.live.ros.start import start_ros

    start_ros()


@pytest.fixture(scope="module", autouse=True)
def domain() -> Iterator[None]:
    """What nodes of this process, and those it starts, talk in."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(next_domain()))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the nodes of a test module write into."""
    return tmp_path_factory.mktemp("live")
