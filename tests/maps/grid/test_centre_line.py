"""The middle of a track closes, is driven the right way round, and its widths are those that were drawn."""

import numpy as np
import pytest
from shapely import LinearRing

from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.centre_line import CentreLine, centre_line
from racecar.maps.grid.lap import find_lap
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

SPACING, SMOOTHING = 0.1, 0.5
INNER, OUTER, RESOLUTION = 3.0, 5.5, 0.02
MAP_FROM_RING = np.array([2.0, -1.0, 0.6])


def ring(*, posts: bool = False) -> OccupancyGrid:
    """A round track with walls two cells thick, unknown behind them; turned in its map."""
    axis = (np.arange(600) + 0.5) * RESOLUTION - 6.0
    x, y = np.meshgrid(axis, axis)
    radius = np.hypot(x, y)
    cells = np.where((radius > INNER - 0.04) & (radius < OUTER + 0.04), OCCUPIED, UNKNOWN)
    cells[(radius > INNER) & (radius < OUTER)] = FREE
    cells[(np.hypot(x - 3.5, y) < 0.01) | (np.hypot(x, y - 4.0) < 0.03)] = (
        UNKNOWN  # seen between no two beams
    )
    if posts:
        cells[np.hypot(x - 4.9, y) < 0.1] = OCCUPIED
    return OccupancyGrid(cells.astype(np.int8), RESOLUTION, compose(MAP_FROM_RING, [-6.0, -6.0, 0.0]))


def driven(rounds: float, *, clockwise: bool = False) -> Pose:
    """(K, 3) not along the middle."""
    angles = np.arange(0.0, 2.0 * np.pi * rounds, 0.05) * (-1.0 if clockwise else 1.0)
    radius = 4.3 + 0.4 * np.sin(3.0 * angles)
    heading = angles + (-np.pi / 2 if clockwise else np.pi / 2)
    poses = np.column_stack([radius * np.cos(angles), radius * np.sin(angles), heading])
    return compose(MAP_FROM_RING, poses)


def line_of(grid: OccupancyGrid, path: Pose, returns: np.ndarray | None = None) -> CentreLine:
    lap = find_lap(path)
    assert lap is not None
    line = centre_line(
        grid, lap, np.zeros((1, 2)) if returns is None else returns, spacing=SPACING, smoothing=SMOOTHING
    )
    assert line is not None
    return line


@pytest.mark.parametrize("clockwise", [False, True])
def test_line_and_widths_are_those_that_were_drawn(clockwise: bool) -> None:
    line = line_of(ring(), driven(1.3, clockwise=clockwise))
    radius = np.hypot(*(line.points - MAP_FROM_RING[:2]).T)
    middle = (INNER + OUTER) / 2
    np.testing.assert_allclose(radius, middle, atol=0.03)
    inner, outer = (line.right, line.left) if clockwise else (line.left, line.right)
    np.testing.assert_allclose(radius - inner, INNER, atol=0.02)
    np.testing.assert_allclose(radius + outer, OUTER, atol=0.02)
    assert line.length == pytest.approx(2.0 * np.pi * middle, rel=0.01)


def test_it_is_closed_evenly_spaced_and_simple_and_begins_where_the_lap_does() -> None:
    path = driven(1.3)
    line = line_of(ring(), path)
    steps = np.hypot(*(np.roll(line.points, -1, axis=0) - line.points).T)
    np.testing.assert_allclose(steps, SPACING, rtol=0.02)
    assert LinearRing(line.points).is_simple
    assert len(line.crossed) == 0
    lap = find_lap(path)
    assert lap is not None
    nearest = np.hypot(*(line.points - lap[0]).T)
    assert nearest[0] < nearest.min() + SPACING


def test_widths_end_where_the_returns_lie() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 4000)
    surfaces = [r * np.column_stack([np.cos(angles), np.sin(angles)]) for r in (INNER - 0.03, OUTER + 0.03)]
    returns = np.concatenate(surfaces) + MAP_FROM_RING[:2]
    line = line_of(ring(), driven(1.3), returns)
    radius = np.hypot(*(line.points - MAP_FROM_RING[:2]).T)
    np.testing.assert_allclose(radius - line.left, INNER - 0.03, atol=0.01)
    np.testing.assert_allclose(radius + line.right, OUTER + 0.03, atol=0.01)


def test_what_stands_in_bounds_the_track() -> None:
    line = line_of(ring(posts=True), driven(1.3))
    post = compose(MAP_FROM_RING, [4.9, 0.0, 0.0])[:2]
    edge = line.points - line.right[:, None] * line.normals
    assert np.min(np.hypot(*(edge - post).T)) < 0.12
    clear = np.hypot(*(line.points - post).T)
    assert clear.min() > 0.8


def test_normals_that_cross_are_named() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    bend = 0.5 * np.column_stack([np.cos(angles), np.sin(angles)])
    wide = CentreLine(bend, right=np.full(40, 0.2), left=np.full(40, 0.6))
    assert len(wide.crossed) > 0
    assert len(CentreLine(bend, right=np.full(40, 0.2), left=np.full(40, 0.4)).crossed) == 0


def test_the_first_lap_that_closes_is_taken() -> None:
    lap = find_lap(driven(2.7))
    assert lap is not None
    length = np.sum(np.hypot(*np.diff(lap, axis=0).T))
    assert 26.0 < length < 30.0
    assert np.hypot(*(lap[-1] - lap[0])) < 0.3


@pytest.mark.parametrize(
    "path",
    [
        driven(0.8),
        np.concatenate([driven(0.4), driven(0.4)[::-1]]),  # there and back
        np.zeros((30, 3)),
        np.zeros((1, 3)),
    ],
)
def test_without_a_way_back_in_the_same_direction_there_is_no_lap(path: Pose) -> None:
    assert find_lap(path) is None


def test_a_path_that_crosses_itself_is_no_lap() -> None:
    """Out, round three quarters, and across the way out."""
    out = np.column_stack([np.linspace(0.0, 6.0, 60), np.zeros(60)])
    angles = np.linspace(-np.pi / 2, np.pi, 90)
    loop = np.column_stack([6.0 + 3.0 * np.cos(angles), 3.0 + 3.0 * np.sin(angles)])
    down = np.column_stack([np.full(80, 3.0), np.linspace(3.0, -5.0, 80)])
    places = np.concatenate([out, loop, down])
    assert find_lap(np.column_stack([places, np.zeros(len(places))])) is None


def test_without_walls_there_is_no_middle() -> None:
    cells = np.zeros((600, 600), dtype=np.int8)
    grid = OccupancyGrid(cells, RESOLUTION, compose(MAP_FROM_RING, [-6.0, -6.0, 0.0]))
    lap = find_lap(driven(1.3))
    assert lap is not None
    assert centre_line(grid, lap, np.zeros((1, 2)), spacing=SPACING, smoothing=SMOOTHING) is None
