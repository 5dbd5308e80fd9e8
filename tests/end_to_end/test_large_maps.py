"""A drive over two kilometres by two is drawn in the memory of what it saw; what cannot read it says so."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.mapping.grid.rendering import Rays
from racecar.mapping.loops.loop_history import LoopHistory
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose, between
from racecar.pipelines.files.session_file import save_session
from racecar.sensors.matching.scan_store import ScanStore, prepare_scan
from tests.end_to_end.commands import in_own_process, report_of
from tests.mapping.sessions import times

SIDE, STEP, SIGHT, BEAMS = 2000.0, 1.0, 10.0, 360
"""Metres of the plane, between keyframes and of sight; beams of a scan."""
MOST_MEGABYTES = 1500.0

pytestmark = pytest.mark.slow


def path() -> Pose:
    """(K, 3) along a Z and back up its open side: 8.5 km."""
    corners = np.array([[0.0, SIDE], [SIDE, SIDE], [0.0, 0.0], [SIDE, 0.0], [SIDE, SIDE / 2]])
    legs = []
    for start, end in pairwise(corners):
        steps = np.arange(0.0, 1.0, STEP / np.hypot(*(end - start)))[:, None]
        heading = np.full(len(steps), np.arctan2(*(end - start)[::-1]))
        legs.append(np.column_stack([start + steps * (end - start), heading]))
    return np.concatenate(legs)


def session() -> Session:
    """A road with a wall to each side, with doors, and open ahead."""
    poses = path()
    bearings = np.linspace(-np.pi, np.pi, BEAMS, endpoint=False)
    store, rays, loops = ScanStore(len(poses)), [], LoopHistory()
    for k in range(len(poses)):
        ranges = np.minimum(3.0 / np.maximum(np.abs(np.sin(bearings + 0.01 * k)), 1e-3), SIGHT)
        ends = np.column_stack([ranges * np.cos(bearings), ranges * np.sin(bearings)])
        is_open = ranges == SIGHT
        rays.append(Rays.to(np.concatenate([ends[~is_open], ends[is_open]]), int(np.sum(~is_open))))
        store.add(prepare_scan(ends[::12]))
        loops.graph.add_keyframe(STEP)
        loops.graph.add_variances(np.array([[0.01**2, 0.001**2]]))
    steps = between(poses[:-1], poses[1:])
    ties = [Constraint(k, k + 1, step, 1e4 * np.eye(3), "scan_matching") for k, step in enumerate(steps)]
    return Session(
        store, rays, np.zeros_like(poses), poses, ConstraintList(ties), loops, times(np.arange(len(poses)))
    )


def test_a_plane_of_four_square_kilometres(tmp_path: Path) -> None:
    (tmp_path / "drive").mkdir()
    save_session(session(), tmp_path / "drive" / "session.npz")
    out = tmp_path / "out"
    in_own_process("render", tmp_path / "drive", "--out", out, "--quiet")
    report = report_of(out)
    assert report["peak_memory_mb"] < MOST_MEGABYTES
    assert min(report["result"]["map_metres"]) > SIDE
    assert any("too many to localize on it" in warning for warning in report["warnings"])
    columns, rows = (round(metres / 0.05) for metres in report["result"]["map_metres"])
    assert (out / "map.pgm").stat().st_size == len(f"P5\n{columns} {rows}\n255\n") + columns * rows
    assert (out / "map.png").stat().st_size > 10_000
    refused = in_own_process("studio", out, code=2)
    assert "pixels; crop it" in refused.stderr
