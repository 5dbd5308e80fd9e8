"""The middle of a track closes, is driven the right way round, and its widths are those that were drawn."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree
from shapely import LinearRing

from racecar.maps.errors import UserError
from racecar.maps.geometry.closed_line import resampled_ring, ring_length, ring_normals
from racecar.maps.geometry.se2 import Pose, between, compose
from racecar.maps.grid.centre_line import CentreLine, centre_line
from racecar.maps.grid.lap import find_lap
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from racecar.maps.grid.track_bounds import Bound
from racecar.maps.grid.winding_numbers import winding_numbers

SPACING, SMOOTHING = 0.1, 0.5
INNER, OUTER, RESOLUTION = 3.0, 5.5, 0.02
MAP_FROM_RING = np.array([2.0, -1.0, 0.6])
HALF = 1.0
T = np.linspace(0.0, 2.0 * np.pi, 4000, endpoint=False)
LONG_ROUND = np.column_stack([5.0 * np.cos(T), 2.0 * np.sin(T)])
CURVES = {
    "eight": np.column_stack([8.0 * np.cos(T), 4.0 * np.sin(2.0 * T)]),
    "flat eight": np.column_stack([9.0 * np.cos(T), 1.9 * np.sin(2.0 * T)]),
    "three lobes": np.column_stack([11.0 * np.cos(T), 3.2 * np.sin(3.0 * T)]),
    "trefoil": 2.6 * np.column_stack([np.sin(T) + 2 * np.sin(2 * T), np.cos(T) - 2 * np.cos(2 * T)]),
}
"""Closed curves that cross themselves, at 46° at the least."""


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
    returns = np.zeros((1, 2)) if returns is None else returns
    return centre_line(grid, lap, returns, spacing=SPACING, smoothing=SMOOTHING)


def lanes(curve: np.ndarray) -> OccupancyGrid:
    """Lanes of half a width of `HALF` along a closed curve (N, 2), with walls three cells thick."""
    low, high = curve.min(axis=0) - 2.0 * HALF, curve.max(axis=0) + 2.0 * HALF
    columns, rows = np.ceil((high - low) / RESOLUTION).astype(int)
    grid = OccupancyGrid(np.zeros((rows, columns), dtype=np.int8), RESOLUTION, np.array([*low, 0.0]))
    is_middle = np.zeros((rows, columns), dtype=np.bool_)
    is_middle[tuple(grid.cell_of(resampled_ring(curve, RESOLUTION / 2)).T)] = True
    away = RESOLUTION * distance_transform_edt(~is_middle)
    cells = np.select([away < HALF, away < HALF + 3 * RESOLUTION], [FREE, OCCUPIED], UNKNOWN)
    return replace(grid, cells=cells.astype(np.int8))


def driven_along(curve: np.ndarray) -> Pose:
    """(K, 3) a round and a quarter along a closed curve (N, 2), swerving."""
    curve = resampled_ring(curve, 0.05)
    swerve = 0.3 * np.sin(np.linspace(0.0, 16.0 * np.pi, len(curve)))
    places = curve + swerve[:, None] * ring_normals(curve)
    places = np.concatenate([places, places[: len(places) // 4]])
    return np.column_stack([places, np.zeros(len(places))])


@pytest.mark.parametrize("clockwise", [False, True])
def test_line_and_widths_are_those_that_were_drawn(clockwise: bool) -> None:
    line = line_of(ring(), driven(1.3, clockwise=clockwise))
    radius = np.hypot(*(line.points - MAP_FROM_RING[:2]).T)
    middle = (INNER + OUTER) / 2
    np.testing.assert_allclose(radius, middle, atol=0.03)
    inner, outer = (
        (line.right.widths, line.left.widths) if clockwise else (line.left.widths, line.right.widths)
    )
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
    np.testing.assert_allclose(radius - line.left.widths, INNER - 0.03, atol=0.01)
    np.testing.assert_allclose(radius + line.right.widths, OUTER + 0.03, atol=0.01)


def test_what_stands_in_bounds_the_track() -> None:
    line = line_of(ring(posts=True), driven(1.3))
    post = compose(MAP_FROM_RING, [4.9, 0.0, 0.0])[:2]
    edge = line.points - line.right.widths[:, None] * line.normals
    assert np.min(np.hypot(*(edge - post).T)) < 0.12
    clear = np.hypot(*(line.points - post).T)
    assert clear.min() > 0.8


def test_normals_that_cross_are_named() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    bend = 0.5 * np.column_stack([np.cos(angles), np.sin(angles)])
    all_of = np.ones(40, dtype=np.bool_)
    narrow, wide = (Bound(np.full(40, width), all_of, all_of) for width in (0.4, 0.6))
    assert len(CentreLine(bend, right=narrow, left=wide).crossed) > 0
    assert len(CentreLine(bend, right=narrow, left=narrow).crossed) == 0


@pytest.mark.parametrize("is_turned", [False, True])
@pytest.mark.parametrize("name", CURVES)
def test_a_lap_that_crosses_itself_is_followed_from_end_to_end(name: str, is_turned: bool) -> None:
    curve = CURVES[name][::-1] if is_turned else CURVES[name]
    line = line_of(lanes(curve), driven_along(curve))
    assert line.length == pytest.approx(ring_length(curve), rel=0.02)
    away, nearest = cKDTree(curve).query(line.points)
    assert away.max() < HALF / 4
    steps = (np.diff(nearest) + len(curve) // 2) % len(curve) - len(curve) // 2
    assert (
        np.mean((steps >= 0) & (steps < len(curve) / 100)) > 0.98
    )  # the nearest at a crossing is of either lane
    assert np.sum(steps) > 0.98 * len(curve)
    assert len(line.crossed) == 0


@pytest.mark.parametrize("name", CURVES)
def test_bounds_go_straight_over_a_crossing_and_are_no_walls_there(name: str) -> None:
    line = line_of(lanes(CURVES[name]), driven_along(CURVES[name]))
    apart = np.abs(np.subtract.outer(np.arange(len(line.points)), np.arange(len(line.points))))
    apart = np.minimum(apart, len(line.points) - apart) * SPACING
    others = np.where(apart > 5.0, np.hypot(*(line.points[:, None] - line.points).transpose(2, 0, 1)), np.inf)
    to_other_lane = others.min(axis=1)
    assert np.mean(line.is_walled[to_other_lane < HALF]) < 0.3
    assert np.all(line.is_walled[to_other_lane > 4.0])
    for bound in (line.left, line.right):
        np.testing.assert_allclose(bound.widths[line.is_walled & (to_other_lane > 4.0)], HALF, atol=0.15)
        assert bound.widths.max() < 2.0 * HALF


def test_a_spin_is_no_crossing() -> None:
    path = driven(1.3)
    angles = np.linspace(0.0, 2.0 * np.pi, 40)
    x, y = path[20, :2]
    spin = np.column_stack([x + 0.4 * np.sin(angles), y + 0.4 * (1.0 - np.cos(angles)), angles])
    line = line_of(ring(), np.concatenate([path[:20], spin, path[20:]]))
    assert LinearRing(line.points).is_simple
    assert line.length == pytest.approx(np.pi * (INNER + OUTER), rel=0.02)


def test_no_width_reaches_around_the_end_of_an_island() -> None:
    """The island is a thin wall; normals that pass its ends would meet the wall beyond the next lane."""
    grid = lanes(LONG_ROUND)
    cells = np.where(grid.cells == UNKNOWN, OCCUPIED, grid.cells)
    middle = np.column_stack([np.linspace(-3.0, 3.0, 1000), np.full(1000, 0.01)])
    inside = winding_numbers(grid, LONG_ROUND) != 0
    cells[inside] = FREE
    cells[tuple(grid.cell_of(middle).T)] = OCCUPIED
    line = line_of(replace(grid, cells=cells), driven_along(LONG_ROUND))
    assert np.all(line.is_walled)
    assert line.widths.max() < 1.3 * line.widths.min()


def walls_of(grid: OccupancyGrid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N, 2) cells that are walls of `ring`, their distances (N,) and angles (N,) from its middle."""
    cells = np.argwhere(grid.cells == OCCUPIED)
    x, y = between(MAP_FROM_RING, np.column_stack([grid.center_of(cells), np.zeros(len(cells))]))[:, :2].T
    return cells, np.hypot(x, y), np.arctan2(y, x)


def test_no_width_reaches_through_a_gap_that_no_car_passes() -> None:
    grid = ring()
    cells, radius, angles = walls_of(grid)
    is_gap = (radius < OUTER - 1.0) & ((INNER * angles) % 1.5 < 0.2)
    grid.cells[tuple(cells[is_gap].T)] = FREE
    grid.cells[(grid.cells == UNKNOWN) & (winding_numbers(grid, driven(1.0)[:, :2]) != 0)] = FREE
    np.testing.assert_allclose(line_of(grid, driven(1.3)).widths, OUTER - INNER, atol=0.1)


def test_the_edge_of_what_was_seen_is_no_wall() -> None:
    grid = ring()
    cells, radius, angles = walls_of(grid)
    grid.cells[tuple(cells[(radius > OUTER - 1.0) & (np.abs(angles) < 0.5)].T)] = UNKNOWN
    line = line_of(grid, driven(1.3))
    assert np.mean(~line.right.is_wall) == pytest.approx(1.0 / (2.0 * np.pi), abs=0.03)
    assert np.all(line.left.is_wall)
    np.testing.assert_allclose(line.widths, OUTER - INNER, atol=0.1)


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


def test_one_lobe_of_a_lap_that_crosses_itself_is_no_lap() -> None:
    for curve in CURVES.values():
        path = driven_along(curve)
        for share in (0.3, 0.5, 0.7, 0.97):
            assert find_lap(path[: int(share * 0.8 * len(path))]) is None


def test_a_hall_is_no_track() -> None:
    """One pillar within the lap, and the walls of the hall far outside."""
    cells = np.full((1000, 1000), FREE, dtype=np.int8)
    cells[:3], cells[-3:], cells[:, :3], cells[:, -3:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    cells[495:505, 495:505] = OCCUPIED
    grid = OccupancyGrid(cells, RESOLUTION, compose(MAP_FROM_RING, [-10.0, -10.0, 0.0]))
    with pytest.raises(UserError, match=r"Along \d\d% of the lap no wall bounds the track on its left"):
        line_of(grid, driven(1.3))


def test_without_walls_there_is_no_middle() -> None:
    cells = np.zeros((600, 600), dtype=np.int8)
    grid = OccupancyGrid(cells, RESOLUTION, compose(MAP_FROM_RING, [-6.0, -6.0, 0.0]))
    with pytest.raises(UserError, match="Along 100% of the lap no wall"):
        line_of(grid, driven(1.3))
