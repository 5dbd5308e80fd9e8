"""Winding numbers are the turns that a closed line makes as seen from a cell."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import wrap_angle
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.winding_numbers import winding_numbers

PLACES = st.lists(st.tuples(*[st.floats(-3.0, 3.0)] * 2), min_size=3, max_size=8, unique=True)


@given(corners=PLACES, yaw=st.floats(-3.0, 3.0), seed=st.integers(0, 1000))
def test_they_are_turns_of_the_view_along_the_line(
    corners: list[tuple[float, float]], yaw: float, seed: int
) -> None:
    grid = OccupancyGrid(np.zeros((40, 50), dtype=np.int8), 0.1, np.array([-2.0, -1.5, yaw]))
    line = np.array(corners)
    along = np.linspace(0.0, 1.0, 500)[:, None, None]
    points = (line + along * (np.roll(line, -1, axis=0) - line)).transpose(1, 0, 2).reshape(-1, 2)
    numbers = winding_numbers(grid, line)
    for cell in np.random.default_rng(seed).integers(0, (40, 50), (20, 2)):
        towards = points - grid.center_of(cell[None])[0]
        if np.hypot(*towards.T).min() > grid.resolution:
            headings = np.arctan2(towards[:, 1], towards[:, 0])
            turned = np.sum(wrap_angle(np.roll(headings, -1) - headings))
            assert numbers[tuple(cell)] == round(turned / (2.0 * np.pi))
