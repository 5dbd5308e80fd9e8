"""The same bag makes the same map, to the byte, in whichever process."""

from pathlib import Path

import pytest

from tests.end_to_end.commands import Racecar, simulate

pytestmark = pytest.mark.slow


def test_a_drive_with_loops_people_and_bad_odometry(racecar_command: Racecar, tmp_path: Path) -> None:
    bag = tmp_path / "drive.bag"
    simulate(racecar_command, bag, 70, "--noise", "full", "--seed", 2, "--walkers", 4)
    for out in ("once", "again"):
        racecar_command("map", bag, "--out", tmp_path / out, "--quiet")
    once, again = ((tmp_path / out / "pose_graph.g2o").read_text() for out in ("once", "again"))
    edges = (line.split()[1:3] for line in once.splitlines() if line.startswith("EDGE_SE2"))
    assert any(int(b) - int(a) > 40 for a, b in edges)  # a loop was closed
    assert once == again
    for name in ("map.pgm", "trajectory.tum"):
        assert (tmp_path / "once" / name).read_bytes() == (tmp_path / "again" / name).read_bytes(), name
