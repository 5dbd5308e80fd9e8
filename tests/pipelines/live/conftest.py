"""Real nodes over real DDS, kept to this machine and to a domain of this test process."""

import os

import pytest

DOMAIN = 1 + os.getpid() % 100
os.environ.update(ROS_DOMAIN_ID=str(DOMAIN), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")


@pytest.fixture(scope="session", autouse=True)
def ros() -> None:
    """Skips where there is no ROS 2: none was sourced, and PyPI has none for this Python or machine."""
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        pytest.skip(f"no ROS 2 here, so no live tests: {error}")
    from racecar.pipelines.live.ros.start import start_ros

    start_ros()
