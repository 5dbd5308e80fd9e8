"""What nodes say over DDS is kept to this machine, and to a domain of each test module."""

from collections.abc import Iterator

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
