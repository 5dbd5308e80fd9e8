"""What is drawn, before a browser gets it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from shapely import LineString, Point

from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from racecar.pipelines.studio.map_image import paint
from racecar.pipelines.studio.outlines import cross, ellipse
from racecar.pipelines.studio.palette import DARK, LIGHT, Backdrop
from racecar.pipelines.studio.scale_bar import round_length
from racecar.pipelines.studio.simplified_line import corners_of_line


@pytest.mark.parametrize("ground", [LIGHT, DARK])
def test_cells_are_painted_in_the_colours_of_the_ground(ground: Backdrop) -> None:
    grid = OccupancyGrid(np.array([[FREE, OCCUPIED, UNKNOWN]], dtype=np.int8), 0.5, np.zeros(3))
    image = paint(grid, ground)
    colors = image.pixels[0, ::2]
    np.testing.assert_array_equal(colors, [ground.free, ground.occupied, ground.unknown])


def test_a_picture_lies_where_a_turned_grid_lies() -> None:
    grid = OccupancyGrid(np.zeros((10, 20), dtype=np.int8), 0.1, np.array([1.0, 2.0, np.pi / 2]))
    image = paint(grid, LIGHT)
    assert image.size == pytest.approx((2.0, 1.0))
    np.testing.assert_allclose(image.map_from_middle, [0.5, 3.0, np.pi / 2])


def test_a_huge_map_becomes_a_picture_that_a_browser_holds() -> None:
    cells = np.zeros((5000, 8000), dtype=np.int8)
    cells[4321, 7654] = OCCUPIED
    image = paint(OccupancyGrid(cells, 0.05, np.zeros(3)), LIGHT)
    assert image.pixels.shape[0] * image.pixels.shape[1] <= 16_000_000
    assert image.size == pytest.approx((400.0, 250.0))
    assert image.pixels.min() == min(LIGHT.occupied)


def test_an_ellipse_has_the_half_axes_of_its_covariance() -> None:
    points = ellipse(np.array([3.0, 4.0]), np.array([[0.04, 0.0], [0.0, 0.01]]), 3.0)
    np.testing.assert_allclose(np.ptp(points, axis=0), [1.2, 0.6], rtol=1e-6)
    np.testing.assert_allclose(points[:-1].mean(axis=0), [3.0, 4.0], atol=1e-9)


def test_a_cross_has_its_middle_where_it_marks() -> None:
    np.testing.assert_allclose(cross(np.array([1.0, 2.0]), 0.6).mean(axis=(0, 1)), [1.0, 2.0])


@pytest.mark.parametrize(
    ("most", "length"), [(0.99, 0.5), (1.0, 1.0), (4.9, 2.0), (37.0, 20.0), (512.0, 500.0)]
)
def test_a_scale_bar_has_a_round_length(most: float, length: float) -> None:
    assert round_length(most) == length


def test_walls_are_wide_enough_from_afar_and_as_they_are_from_near() -> None:
    cells = np.zeros((9, 9), dtype=np.int8)
    cells[:, 4] = OCCUPIED
    grid = OccupancyGrid(cells, 0.05, np.zeros(3))
    rows = [paint(grid, LIGHT, pixel=pixel, least_wall=3.0).pixels[4] for pixel in (0.05, 0.01)]
    dark = [np.count_nonzero(np.all(row == LIGHT.occupied, axis=1)) for row in rows]
    assert dark == [2, 2]  # cells of 1 pixel, and two pixels of a texture for a cell of 5


@given(
    arrays(np.int64, (30, 2), elements=st.integers(-3000, 3000)),
    arrays(np.float64, 29, elements=st.sampled_from([0.0, 0.4, 1.0])),
)
def test_a_simplified_line_keeps_its_ends_its_course_and_its_shades(
    centimetres: NDArray[np.int64], shares: NDArray[np.float64]
) -> None:
    points = 0.01 * centimetres
    kept = corners_of_line(points, shares, 0.1)
    assert (kept[0], kept[-1]) == (0, 29)
    np.testing.assert_array_equal(shares, np.repeat(shares[kept[:-1]], np.diff(kept)))
    line = LineString(points[kept])
    assert max(line.distance(Point(point)) for point in points) < 0.1 + 1e-9
