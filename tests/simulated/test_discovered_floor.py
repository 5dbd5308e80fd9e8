"""The shipped building is discovered by goals that are clicked anywhere on its floor."""

from pathlib import Path

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.distance_field import sample_field
from racecar.maps.grid.occupancy_grid import FREE, OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.pipelines.files.session_file import load_session
from racecar.pipelines.runs.evaluation.wall_fit import distance_to_surface
from racecar.pipelines.simulation.driven_simulation import Conditions, DrivenSimulation
from racecar.pipelines.studio.drive.discovery import Discovery

GOALS = 25
FRAME = 0.05
"""Seconds, as the page lets pass at a time."""
LONGEST = 120.0
"""Seconds of a drive to a goal."""
FINER = 5
"""Times as fine as its cells the plan is drawn, so that a return's distance to a wall is known to 1 cm."""


@pytest.mark.slow
def test_a_floor_discovered_by_clicked_goals_is_right(tmp_path: Path) -> None:
    plan = load_map("building")
    start = discover(plan, tmp_path, seed=1)
    returns = transform_points(start, load_session(tmp_path).points.astype(np.float64))
    fine = OccupancyGrid(
        plan.cells.repeat(FINER, axis=0).repeat(FINER, axis=1), plan.resolution / FINER, plan.map_from_grid
    )
    assert sample_field(distance_to_surface(fine), fine, returns).mean() < 0.02
    seen = np.count_nonzero(load_map(tmp_path).cells == FREE) / np.count_nonzero(plan.cells == FREE)
    assert seen > 0.8


def discover(plan: OccupancyGrid, folder: Path, seed: int) -> Pose:
    """Drive to the goals and save the map; returns where on the plan (3,) the map has its origin."""
    generator = np.random.default_rng(seed)
    simulation = DrivenSimulation(plan, Conditions(), seed)
    start = simulation.truth
    discovery = Discovery(MappingConfig(), start)
    floor = plan.center_of(np.argwhere(plan.cells == FREE))
    clicked = 0
    while clicked < GOALS:
        try:
            simulation.drive_to(floor[generator.integers(len(floor))])
        except UserError:  # too near to a wall, as a person would see
            continue
        clicked += 1
        end = simulation.seconds + LONGEST
        while simulation.is_underway and simulation.seconds < end:
            discovery.take(simulation.advance(FRAME), simulation.truth, simulation.seconds)
    discovery.save(folder)
    return start
