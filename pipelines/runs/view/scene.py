"""What to show of a run."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Sight:
    """A scan."""

    stamp: int
    points_in_base: NDArray[np.float32]
    """(N, 2) metres."""


@dataclass(frozen=True, eq=False)
class ParticleCloud:
    """Particles at one time."""

    stamp: int
    map_from_base: Pose
    """(N, 3)"""


@dataclass(frozen=True, eq=False)
class Doubt:
    """A doubtful segment of the drive."""

    why: str
    """A sentence for people."""
    place: NDArray[np.float64]
    """(2,) metres in the map, the midpoint of the segment."""
    seconds: tuple[float, float] | None
    """Since the start of the drive; None for an earlier drive."""


@dataclass(eq=False)
class Scene:
    """A run for display; whatever the run did not save is empty."""

    title: str
    about: str
    """Markdown."""
    trajectory: Trajectory
    grid: OccupancyGrid | None = None
    keyframes: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    """(K, 2) positions."""
    loops: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2, 2)))
    """(L, 2, 2) the two positions connected by each loop closure."""
    matches: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2, 2)))
    """(M, 2, 2) the two positions connected by each scan match."""
    misses: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """(M,) residuals of the matches in the map, in metres."""
    sights: list[Sight] = field(default_factory=list)
    clouds: list[ParticleCloud] = field(default_factory=list)
    covariances: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3, 3)))
    """(S, 3, 3) of x, y (m) and yaw (rad), one for each pose of the trajectory."""
    doubts: list[Doubt] = field(default_factory=list)
    """In decreasing order of importance."""

    @property
    def deviations(self) -> NDArray[np.float64]:
        """(S, 2) standard deviations of position (m) and heading (rad) at each pose of the trajectory."""
        variances = np.diagonal(self.covariances, axis1=1, axis2=2)
        deviations: NDArray[np.float64] = np.sqrt(
            np.column_stack([variances[:, 0] + variances[:, 1], variances[:, 2]])
        )
        return deviations
