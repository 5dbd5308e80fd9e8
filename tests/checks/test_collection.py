"""Where no ROS is installed, as on macOS, its tests are skipped and all others run."""

import subprocess
import sys

from tests.checks.english import REPOSITORY


def test_tests_of_live_nodes_are_collected_without_ros() -> None:
    of_nodes = [
        path
        for path in (REPOSITORY / "tests").rglob("test_*.py")
        if "pipelines.live" in path.read_text("utf-8")
    ]
    assert len(of_nodes) > 20
    options = ["-p", "tests.without_ros", "-p", "no:cacheprovider", "-p", "no:xdist", "--collect-only"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *options, *map(str, of_nodes)],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout[-3000:]
