"""Drives through twin corridors with alike niches are joined where they went, or not at all."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from racecar.mapping.loops.submap_matching import nearest_pairs
from racecar.mapping.session.merging import EarlierMap, merge
from racecar.mapping.session.session import Session
from racecar.mapping.session.unrecognized import NotRecognizedError
from racecar.maps.geometry.se2 import Pose, between, compose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import LaserKind, SimulationConfig
from tests.mapping.mapped import mapped

CELL, MARGIN = 0.05, 2.0
LENGTH, WIDTH, APART = 48.0, 2.4, 10.0
PITCH, NICHE, DEPTH = 6.0, 1.2, 0.6
PRESENT = 0.6
"""Share of the niches that are not walled up: the corridors differ in these alone."""


def niches(generator: np.random.Generator) -> NDArray[np.bool_]:
    """(2, N) which ones a corridor has on either side."""
    return generator.random((2, round(LENGTH / PITCH) - 1)) < PRESENT


def plan(corridors: list[NDArray[np.bool_]]) -> OccupancyGrid:
    """Corridors side by side, connected at one end."""
    high = (len(corridors) - 1) * APART + WIDTH
    rows, columns = (round((size + 2 * MARGIN) / CELL) for size in (high, LENGTH))
    cells = np.full((rows, columns), OCCUPIED, dtype=np.int8)

    def clear(x: float, y: float, width: float, height: float) -> None:
        box = (x + MARGIN, y + MARGIN, width, height)
        column, row, columns, rows = (round(metres / CELL) for metres in box)
        cells[row : row + rows, column : column + columns] = FREE

    clear(0.0, 0.0, WIDTH, high)
    for number, present in enumerate(corridors):
        y = number * APART
        clear(0.0, y, LENGTH, WIDTH)
        for side, k in np.argwhere(present).tolist():
            clear((k + 1) * PITCH - NICHE / 2, y + (WIDTH if side else -DEPTH), NICHE, DEPTH)
    return OccupancyGrid(cells, CELL, np.array([-MARGIN, -MARGIN, 0.0]))


@dataclass(frozen=True)
class Drive:
    """A drive that was mapped."""

    session: Session
    truth: Pose
    """(K, 3) true poses of the keyframes."""


def drive(grid: OccupancyGrid, config: SimulationConfig) -> Drive:
    simulation = Simulation(grid, config)
    result = mapped(simulation.messages())
    true = simulation.ground_truth.map_from_base[result.keyframe_indices]
    return Drive(result.session, compose(true, BASE_FROM_LASER))


def drives(number: int) -> tuple[Drive, Drive]:
    """A map of one or both corridors, and a later drive of half a minute: in the first one, or, where the
    number is odd, in a twin that the map does not show."""
    generator = np.random.default_rng([number, 58])
    one, other = niches(generator), niches(generator)
    is_same, of_both = number % 2 == 0, number % 4 == 0
    laser = LaserKind.ROUND if number % 3 else LaserKind.RACE
    settings = {"laser": laser, "scan_every": 0.0 if laser == LaserKind.ROUND else 0.1}
    known = plan([one, other] if of_both else [one])
    start = (float(generator.uniform(8.0, 40.0)), WIDTH / 2, float(generator.choice([0.0, np.pi])))
    seconds = float(generator.uniform(18.0, 28.0))
    later = SimulationConfig(seed=number + 100, start=start, duration=seconds, **settings)
    driven = known if is_same else plan([other])
    return drive(known, SimulationConfig(seed=number, **settings)), drive(driven, later)


def farthest_off(joint: Session, earlier: Drive, later: Drive) -> float:
    """Metres by which keyframes of the later drive miss the one of the earlier drive that saw most alike: two
    passes of the earlier drive alone may be as far apart as the bar."""
    first = len(earlier.truth)
    nearest = [nearest_pairs(earlier.truth, true[None], 1)[0][0] for true in later.truth]
    found = between(joint.map_from_keyframe[nearest], joint.map_from_keyframe[first:])
    missed = between(between(earlier.truth[nearest], later.truth), found)
    return float(np.hypot(missed[:, 0], missed[:, 1]).max())


@pytest.mark.slow
@pytest.mark.parametrize("number", range(20))
def test_a_drive_is_joined_where_it_went_or_not_at_all(number: int) -> None:
    earlier, later = drives(number)
    if number % 2:
        with pytest.raises(NotRecognizedError):
            merge(EarlierMap(earlier.session), later.session)
    else:
        joint = merge(EarlierMap(earlier.session), later.session)
        assert farthest_off(joint, earlier, later) < 0.03
