"""The grid shows what the rays saw: free up to a wall, occupied on it, unknown behind it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from racecar.mapping.grid import rendering
from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.grid.rendering import Rays, pack_rays
from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, UNKNOWN, OccupancyGrid
from racecar.sensors.scan import Scan
from tests.mapping.sessions import one_drive
from tests.sensors.worlds import BEARINGS

RESOLUTION = 0.05
DEFAULT = RenderingConfig()
at_origin = IDENTITY[None]


def rays_of(scan: Scan, points: np.ndarray, config: RenderingConfig = DEFAULT) -> Rays:
    return rendering.rays_of(scan, points, config)


def render(rays: list[Rays], poses: Pose, resolution: float) -> OccupancyGrid:
    return rendering.render(rays, poses, one_drive(len(rays)), resolution, DEFAULT).in_one_piece()


def occupancy_at(grid, points: np.ndarray) -> np.ndarray:
    rows, columns = grid.cell_of(points).T
    return grid.cells[rows, columns]


def ray(length: float, bearing: float = 0.0) -> Rays:
    end = length * np.array([[np.cos(bearing), np.sin(bearing)]])
    return Rays.to(end, 1)


@given(arrays(np.float64, (5, 2), elements=st.floats(-60.0, 60.0)))
def test_rays_end_within_a_millimetre_and_stay_so(ends: np.ndarray) -> None:
    rays = Rays.to(ends, 5)
    assert np.abs(rays.ends - ends).max() < 0.00101
    np.testing.assert_array_equal(Rays.to(rays.ends, 5).packed, rays.packed)


@given(st.lists(st.one_of(st.none(), st.integers(0, 5)), max_size=6), st.integers(0, 2**32))
def test_packed_rays_are_the_same_rays(counts: list[int | None], seed: int) -> None:
    rng = np.random.default_rng(seed)
    seen = [Rays.none() if count is None else Rays.to(rng.normal(size=(count, 2)), count) for count in counts]
    packed = list(seen)
    pack_rays(packed)
    for before, after in zip(seen, packed, strict=True):
        assert after.are_kept == before.are_kept
        assert after.returns == before.returns
        np.testing.assert_array_equal(after.ends, before.ends)


def test_a_wall_hides_what_lies_behind_it() -> None:
    grid = render([ray(2.0), ray(5.0, 1.5)], np.zeros((2, 3)), RESOLUTION)
    assert occupancy_at(grid, np.array([[2.01, 0.01]]))[0] >= OCCUPIED_FROM
    assert occupancy_at(grid, np.array([[2.2, 0.01]]))[0] == UNKNOWN


def test_who_passes_by_leaves_no_trace_once_the_place_was_looked_through() -> None:
    passer_by, open_ways = [ray(1.0)], [ray(3.0)] * 4
    place = np.array([[1.01, 0.01]])
    assert occupancy_at(render(passer_by, np.zeros((1, 3)), RESOLUTION), place)[0] >= OCCUPIED_FROM
    grid = render(passer_by + open_ways, np.zeros((5, 3)), RESOLUTION)
    assert occupancy_at(grid, place)[0] < OCCUPIED_FROM


def test_one_scan_tells_a_cell_once() -> None:
    """However many of its beams end in a cell, and though others cross it."""
    once = render([ray(1.02)], at_origin, 0.25)
    many = Rays.to(np.array([[1.02, 0.01], [1.05, 0.02], [1.1, 0.05], [2.0, 0.02]]), 4)
    often = render([many], at_origin, 0.25)
    place = np.array([[1.02, 0.01]])
    assert occupancy_at(often, place)[0] == occupancy_at(once, place)[0]


def test_a_miss_clears_the_first_metres_and_marks_no_wall() -> None:
    nothing = np.full(len(BEARINGS), np.inf)
    nothing[0] = np.nan
    scan = Scan(0, BEARINGS, nothing, np.zeros(len(BEARINGS)), IDENTITY, 30.0)
    rays = rays_of(scan, scan.points_in_laser())
    assert rays.returns == 0
    assert len(rays.ends) == len(BEARINGS) - 1  # no information clears nothing
    grid = render([rays], at_origin, RESOLUTION)
    assert grid.cells.max() < OCCUPIED_FROM
    assert occupancy_at(grid, np.array([[4.9, 0.02]]))[0] > UNKNOWN
    assert occupancy_at(grid, np.array([[5.5, 0.02]]))[0] == UNKNOWN


def cleared_by(ranges: np.ndarray, step: float = np.radians(1.0)) -> np.ndarray:
    """Metres that each miss clears, of beams at such a step about straight ahead."""
    bearings = step * (np.arange(len(ranges)) - len(ranges) // 2)
    scan = Scan(0, bearings, ranges, np.zeros(len(ranges)), IDENTITY, 30.0)
    rays = rays_of(scan, scan.points_in_laser())
    return np.hypot(*rays.ends[rays.returns :].T)


@pytest.mark.parametrize("lost", [[5], [5, 6, 7], [0], [18], [3, 9, 10]])
def test_beams_that_are_lost_here_and_there_clear_no_farther_than_their_neighbours(lost: list[int]) -> None:
    ranges = np.linspace(2.0, 3.0, 19)
    ranges[lost] = np.inf
    cleared = cleared_by(ranges)
    assert len(cleared) == len(lost)
    assert np.all((cleared > 1.99) & (cleared < 3.01))


def test_at_an_edge_a_lost_beam_clears_as_far_as_the_nearer_side() -> None:
    assert cleared_by(np.array([2.0, 2.0, np.inf, 7.0, 7.0])) == pytest.approx([2.0], abs=0.003)


def through_a_door(distance: float) -> np.ndarray:
    width = int(np.degrees(0.8 / distance))
    is_open = np.abs(np.arange(180) - 90 + 0.5) < width // 2
    return np.where(is_open, np.inf, distance)


@pytest.mark.parametrize(
    "ranges",
    [
        *(through_a_door(distance) for distance in (0.7, 2.0, 3.0)),
        np.where(np.arange(90) == 40, np.inf, 10.0),  # a gap of one beam far away
        np.where(np.isin(np.arange(180), [60, 90]), 1.0, np.inf),  # returns amid open space bound nothing
    ],
)
def test_misses_clear_what_lies_behind(ranges: np.ndarray) -> None:
    np.testing.assert_allclose(cleared_by(ranges), 5.0, atol=0.003)


def fan(length: float, returns: bool) -> Rays:
    """Beams over 60° ahead that all end at x = ``length``, or miss and clear 5 m."""
    bearings = np.radians(np.arange(-30.0, 30.0, 0.5))
    along = length / np.cos(bearings) if returns else np.full(len(bearings), 5.0)
    ends = along[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])
    return Rays.to(ends, len(ends) if returns else 0)


@pytest.mark.parametrize("order", [1, -1])
def test_a_miss_ends_at_a_wall_that_other_scans_saw(order: int) -> None:
    """Of glass, for instance, which reflects only at some angles; it fades if it is missed often."""
    rays = [*[fan(2.02, returns=True)] * 6, *[fan(2.02, returns=False)] * 12][::order]
    grid = render(rays, np.zeros((18, 3)), RESOLUTION)
    sides = np.linspace(-1.0, 1.0, 21)
    assert occupancy_at(grid, np.column_stack([np.full(21, 2.02), sides])).min() >= OCCUPIED_FROM
    assert occupancy_at(grid, np.column_stack([np.full(21, 1.9), sides])).max() < 1
    assert occupancy_at(grid, np.column_stack([np.full(21, 2.2), sides])).max() == UNKNOWN


@pytest.mark.parametrize("order", [1, -1])
def test_who_passes_by_in_open_space_leaves_no_trace(order: int) -> None:
    """Nothing but misses shows that he has gone."""
    rays = [*[fan(2.02, returns=True)] * 2, *[fan(2.02, returns=False)] * 14][::order]
    grid = render(rays, np.zeros((16, 3)), RESOLUTION)
    ahead = np.column_stack([np.arange(0.5, 4.0, 0.1), np.full(35, 0.01)])
    assert occupancy_at(grid, ahead).max() < OCCUPIED_FROM
    assert occupancy_at(grid, ahead).min() > UNKNOWN


def test_a_scan_wears_no_wall_that_it_hits() -> None:
    """Though others of its beams are lost in the same cells."""
    bearings = np.radians(np.arange(-30.0, 30.0, 0.25))
    ends = (2.02 / np.cos(bearings))[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])
    whole = render([Rays.to(ends[::2], len(ends[::2]))], at_origin, RESOLUTION)
    worn = render(
        [Rays.to(np.concatenate([ends[::2], 1.1 * ends[1::2]]), len(ends[::2]))], at_origin, RESOLUTION
    )
    assert occupancy_at(worn, ends[::2]).min() == occupancy_at(whole, ends[::2]).min() >= OCCUPIED_FROM


def test_a_far_return_does_not_blow_up_the_map() -> None:
    points = np.array([[2.0, 0.0], [500.0, 0.0]])
    scan = Scan(0, BEARINGS[:2], np.array([2.0, 500.0]), np.zeros(2), IDENTITY, 1000.0)
    assert render([rays_of(scan, points)], at_origin, RESOLUTION).cells.size < 10_000


def cells_of_drives(drives: list[list[float]], places: list[float]) -> list[int]:
    """Percent occupied at distances straight ahead, where drives saw returns at some distances each."""
    rays = [ray(reach) for drive in drives for reach in drive]
    numbers = np.repeat(np.arange(len(drives)), [len(drive) for drive in drives]).astype(np.int32)
    grid = rendering.render(rays, np.zeros((len(rays), 3)), numbers, RESOLUTION, DEFAULT).in_one_piece()
    return occupancy_at(grid, np.array([[place, 0.01] for place in places])).tolist()


def test_what_a_later_drive_sees_is_believed() -> None:
    gone, new = [2.0] * 60, [3.0] * 12
    box, wall = cells_of_drives([gone, new], [2.01, 3.01])
    assert box < 20 and wall >= OCCUPIED_FROM
    box, free = cells_of_drives([new, gone], [2.01, 1.0])
    assert box >= OCCUPIED_FROM and free < 20


def test_a_glance_does_not_contradict_what_a_drive_saw_often() -> None:
    assert cells_of_drives([[2.0] * 60, [3.0] * 2], [2.01])[0] >= OCCUPIED_FROM
    assert cells_of_drives([[3.0] * 60, [2.0]], [2.01])[0] < OCCUPIED_FROM


def test_what_no_later_drive_sees_stays_as_it_was() -> None:
    seen, free, unknown = cells_of_drives([[2.0] * 60, *([[0.5]] * 30)], [2.01, 1.0, 2.5])
    assert seen >= OCCUPIED_FROM and 0 <= free < 20 and unknown == UNKNOWN
