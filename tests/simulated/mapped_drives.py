"""Simulated drives through the mapper, and how far from the truth it ends."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.harness.input_faults import fewer_beams
from racecar.mapping.config import MappingConfig
from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.state.result import MappingResult
from racecar.maps.geometry.se2 import Pose, between, compose, inverse, transform_points
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.mapping.mapped import mapped


@dataclass(frozen=True, eq=False)
class MappedDrive:
    """A drive that was mapped."""

    plan: OccupancyGrid
    result: MappingResult
    truth: Pose
    """(N, 3) the pose of each scan in the plan."""

    @property
    def errors(self) -> Pose:
        """(N, 3) of the poses seen from the first one."""
        found = self.result.trajectory.map_from_base
        return between(between(self.truth[0], self.truth), between(found[0], found))

    @property
    def drift(self) -> float:
        """Largest error of a position, as a share of the way driven."""
        length = np.hypot(*np.diff(self.truth[:, :2], axis=0).T).sum()
        return float(np.hypot(self.errors[:, 0], self.errors[:, 1]).max() / length)

    @property
    def length_error(self) -> float:
        """Of the distance from the start to the place farthest from it, as a share."""
        found = self.result.trajectory.map_from_base
        true = np.hypot(*(self.truth - self.truth[0])[:, :2].T)
        farthest = int(np.argmax(true))
        return float(abs(np.hypot(*(found[farthest] - found[0])[:2]) / true[farthest] - 1.0))

    @property
    def loop_errors(self) -> np.ndarray:
        """(L, 2) metres and degrees by which each accepted loop closure misses the truth, the metres beyond
        its own standard deviation: along a bare corridor it says itself that it hardly knows."""
        true = self.truth[self.result.keyframe_indices]
        return np.array(
            [
                _missed(c, between(true[c.from_keyframe], true[c.to_keyframe]))
                for c in self.result.constraints
                if c.kind == "loop_closure"
            ]
        ).reshape(-1, 2)

    def mean_relation_error(self, reach: float = 10.0, pairs: int = 2000) -> float:
        """Metres, over random pairs of scans up to ``reach`` metres apart in truth, in one pass or in two."""
        rng = np.random.default_rng(0)
        found, tree = self.result.trajectory.map_from_base, cKDTree(self.truth[:, :2])
        a = rng.integers(0, len(self.truth), pairs)
        b = np.array([rng.choice(tree.query_ball_point(self.truth[k, :2], reach)) for k in a])
        missed = between(between(self.truth[a], self.truth[b]), between(found[a], found[b]))
        return float(np.hypot(missed[:, 0], missed[:, 1]).mean())

    def share_off_walls(self, distance: float = 0.2) -> float:
        """Of the map's occupied cells, those farther than ``distance`` metres from any wall of the plan.

        Each cell is carried into the plan along with the keyframe nearest to it, so that a map that is bent
        as a whole does not count.
        """
        grid, keyframes = self.result.grid, self.result.keyframe_indices
        cells = grid.center_of(np.argwhere(grid.cells >= 65))
        found = self.result.trajectory.map_from_base[keyframes]
        nearest = cKDTree(found[:, :2]).query(cells)[1]
        plan_from_map = compose(self.truth[keyframes], inverse(found))
        placed = np.array(
            [
                transform_points(plan_from_map[k], cell[None])[0]
                for k, cell in zip(nearest, cells, strict=True)
            ]
        )
        walls = self.plan.center_of(np.argwhere(self.plan.cells >= OCCUPIED_FROM))
        return float((cKDTree(walls).query(placed)[0] > distance).mean())


def _missed(loop: Constraint, true: Pose) -> tuple[float, float]:
    missed = between(true, loop.from_pose_to_pose)
    informations, directions = np.linalg.eigh(loop.information[:2, :2])
    beyond = np.maximum(np.abs(missed[:2] @ directions) - informations**-0.5, 0.0)
    return float(np.hypot(*beyond)), float(np.rad2deg(abs(missed[2])))


@cache
def _plan(name: str) -> OccupancyGrid:
    """One object each, so that the route through it is planned once."""
    return load_map(Path(name))


def map_drive(
    plan: str,
    *,
    close_loops: bool = True,
    every: int = 1,
    beams_every: int = 1,
    has_wheels: bool = True,
    **settings: object,
) -> MappedDrive:
    """Simulate with some settings of `SimulationConfig`, and map every so many scans and beams."""
    grid = _plan(plan)
    simulation = Simulation(grid, SimulationConfig(**settings))

    def seen() -> Iterator[Scan | Odometry]:
        scans = 0
        for message in simulation.messages():
            is_scan = isinstance(message, Scan)
            if scans % every == 0 if is_scan else has_wheels:
                yield from fewer_beams([message], beams_every)
            scans += is_scan

    result = mapped(seen(), MappingConfig(close_loops=close_loops))
    return MappedDrive(grid, result, simulation.ground_truth.map_from_base[::every])
