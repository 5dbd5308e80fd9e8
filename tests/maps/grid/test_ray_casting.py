"""Ray casting against clipping the ray with every occupied cell."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, compose, inverse
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan, cast_rays


def range_by_clipping(grid: OccupancyGrid, map_from_laser: Pose, bearing: float, shrink: float) -> float:
    """The nearest of the ray's entries into the occupied squares, each shrunk by some metres on all sides."""
    x, y, heading = compose(compose(inverse(grid.map_from_grid), map_from_laser), [0.0, 0.0, bearing])
    start, step = np.array([x, y]), np.array([np.cos(heading), np.sin(heading)])
    corners = np.argwhere(grid.cells == 100)[:, ::-1] * grid.resolution
    with np.errstate(divide="ignore", invalid="ignore"):
        near = (corners + shrink - start) / step
        far = (corners + grid.resolution - shrink - start) / step
    entry = np.nanmax(np.minimum(near, far), axis=1, initial=0.0)
    leave = np.nanmin(np.maximum(near, far), axis=1, initial=np.inf)
    met = entry[entry <= leave]
    return float(met.min()) if len(met) else np.inf


grids = st.builds(
    OccupancyGrid,
    arrays(
        np.int8,
        array_shapes(min_dims=2, max_dims=2, max_side=12),
        elements=st.sampled_from([-1, 0, 0, 0, 0, 100]),
    ),
    st.sampled_from([0.05, 0.1, 1.0]),
    st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-4, 4)).map(np.array),
)


@given(
    grid=grids,
    place=st.tuples(st.floats(-0.5, 1.5), st.floats(-0.5, 1.5)),
    heading=st.floats(-4, 4),
    bearing=st.floats(-4, 4),
)
def test_ranges_are_exact(
    grid: OccupancyGrid, place: tuple[float, float], heading: float, bearing: float
) -> None:
    size = np.array(grid.cells.shape[::-1]) * grid.resolution
    map_from_laser = compose(grid.map_from_grid, [*(np.array(place) * size), heading])
    grown = range_by_clipping(grid, map_from_laser, bearing, shrink=-1e-9)
    shrunk = range_by_clipping(grid, map_from_laser, bearing, shrink=1e-9)
    assume(np.isclose(grown, shrunk, atol=1e-6))  # A ray along an edge or through a corner may go either way.
    measured = cast_rays(grid, map_from_laser, [bearing], max_range=1e3)[0]
    assert measured == pytest.approx(shrunk, abs=1e-6)


def box(side: int = 101, resolution: float = 0.1) -> OccupancyGrid:
    cells = np.zeros((side, side), dtype=np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    return OccupancyGrid(cells, resolution, np.array([-5.05, -5.05, 0.0]))


@pytest.mark.parametrize(
    ("pose", "degrees", "max_range", "expected"),
    [
        ((0, 0, 0), [0, 45, 90, 180, -90], 30.0, [4.95, 4.95 * np.sqrt(2), 4.95, 4.95, 4.95]),
        ((0, 0, 0), [0, 45], 5.0, [4.95, np.inf]),  # beyond the maximum range is a miss
        ((5.0, 0, 0.3), [0], 30.0, [0.0]),  # within a wall
        ((-8.05, 0, 0), [0, 180], 30.0, [3.0, np.inf]),  # from outside, and past the grid
        ([(0, 0, 0), (1, 0, 0), (0, 2, np.pi / 2)], [0, 0, 0], 30.0, [4.95, 3.95, 2.95]),  # each its own pose
    ],
)
def test_a_box_is_measured(
    pose: object, degrees: list[float], max_range: float, expected: list[float]
) -> None:
    measured = cast_rays(box(), np.array(pose, dtype=float), np.radians(degrees), max_range=max_range)
    np.testing.assert_allclose(measured, expected, atol=1e-9)


def test_a_fan_is_all_bearings_from_all_poses() -> None:
    generator = np.random.default_rng(3)
    poses: NDArray[np.float64] = generator.uniform([-4, -4, -3], [4, 4, 3], (5, 3))
    bearings = generator.uniform(-2.3, 2.3, 7)
    fans = cast_ray_fan(box(), poses, bearings, max_range=30.0)
    assert fans.shape == (5, 7)
    each = [cast_rays(box(), poses[i], bearings, max_range=30.0) for i in range(5)]
    np.testing.assert_array_equal(fans, each)
