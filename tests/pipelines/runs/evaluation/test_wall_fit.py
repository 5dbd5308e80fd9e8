"""How well scans lie on walls."""

import numpy as np
import pytest

from racecar.maps.geometry.se2 import IDENTITY
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.pipelines.runs.evaluation.wall_fit import WallFit
from racecar.sensors.scan import Scan


@pytest.fixture
def walls() -> WallFit:
    """A wall along y from x = 2.0 to 2.05 m."""
    cells = np.full((80, 80), FREE, dtype=np.int8)
    cells[:, 40] = OCCUPIED
    return WallFit(OccupancyGrid(cells, 0.05, IDENTITY))


def scan(ranges: list[float]) -> Scan:
    beams = np.zeros(len(ranges))
    return Scan(0, beams, np.array(ranges), beams, IDENTITY, 10.0)


def test_the_share_of_end_points_near_a_wall(walls: WallFit) -> None:
    pose = np.array([0.5, 2.0, 0.0])
    assert walls.share(scan([1.52, 1.44, 1.60, 1.0]), pose) == 0.75
    assert walls.share(scan([1.52, 1.44, 1.60, 1.0]), pose + np.array([0.5, 0.0, 0.0])) == 0.25


def test_a_scan_without_returns_has_no_share(walls: WallFit) -> None:
    assert np.isnan(walls.share(scan([np.inf, np.nan]), IDENTITY))


def test_deep_inside_a_wall_is_not_on_it() -> None:
    """Or a map whose colours mean the opposite would explain every scan from everywhere."""
    cells = np.full((80, 80), OCCUPIED, dtype=np.int8)
    cells[:, :40] = FREE
    fit = WallFit(OccupancyGrid(cells, 0.05, IDENTITY))
    pose = np.array([0.5, 2.0, 0.0])
    assert fit.share(scan([1.45, 1.55]), pose) == 1.0
    assert fit.share(scan([1.80, 2.5, 3.0]), pose) == 0.0


def test_the_share_that_chance_would_give(walls: WallFit) -> None:
    assert walls.share_of_map == pytest.approx(5 / 80)
