"""The turn that makes walls straight is found whatever way the map lies, and clutter does not move it."""

import numpy as np
import pytest

from racecar.mapping.session.wall_direction import wall_direction
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose
from racecar.sensors.matching.scan_store import PreparedScan, ScanStore
from tests.sensors.worlds import ROOM, store_of

AT = np.array([[0.0, 0.0, 0.3], [0.5, -0.4, 2.0], [-0.6, 0.3, -2.4]])


def degrees_off(direction: float, turn: float) -> float:
    return abs((np.rad2deg(direction - turn) + 45.0) % 90.0 - 45.0)


@pytest.mark.parametrize("turn", [0.0, 0.3, 0.78, -0.5, 2.9])
def test_walls_are_found_whatever_way_they_run(turn: float) -> None:
    moved: Pose = compose([1.0, 2.0, turn], AT)
    direction = wall_direction(store_of(ROOM, AT), moved)
    assert direction is not None
    assert -np.pi / 4 <= direction < np.pi / 4
    assert degrees_off(direction, turn) < 0.1


def test_lines_that_run_elsewhere_do_not_count() -> None:
    """A third of all lines lie anyhow, a fifth along another wing, and normals scatter."""
    rng = np.random.default_rng(5)
    main = 0.31 + rng.integers(0, 4, 2000) * np.pi / 2
    angles = np.concatenate([main, np.full(800, 0.75), rng.uniform(-np.pi, np.pi, 1200)])
    angles += rng.normal(0.0, np.deg2rad(1.5), len(angles))
    store = ScanStore()
    for part in np.split(rng.permutation(angles), 20):
        points = np.column_stack([np.linspace(1.0, 2.0, len(part)), np.zeros(len(part))])
        normals = np.column_stack([np.cos(part), np.sin(part)])
        store.add(PreparedScan(points.astype(np.float32), normals.astype(np.float32)))
    direction = wall_direction(store, np.zeros((20, 3)))
    assert direction is not None
    assert degrees_off(direction, 0.31) < 0.2


def test_without_lines_there_is_no_direction() -> None:
    store = ScanStore()
    store.add(PreparedScan(np.zeros((0, 2), np.float32), np.zeros((0, 2), np.float32)))
    assert wall_direction(store, IDENTITY[None]) is None
