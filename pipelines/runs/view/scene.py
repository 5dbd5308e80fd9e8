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
    floor_plan: OccupancyGrid | None = None
    """The plan under the map, in its frame."""
    keyframes: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    """(K, 2) positions."""
    loops: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2, 2)))
    """(L, 2, 2) the two positions connected by each loop closure."""
    matches: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2, 2)))
    """(M, 2, 2) the two positions connected by each scan match."""
    misses: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """(M,) residuals of the matches in the map, in metres."""
    match_stamps: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """(M,) nanoseconds of the later scan of each match; 0 if it is of an earlier drive."""
    sights: list[Sight] = field(default_factory=list)
    clouds: list[ParticleCloud] = field(default_factory=list)
    covariances: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3, 3)))
    """(S, 3, 3) of x, y (m) and yaw (rad), one for each pose of the trajectory."""
    doubts: list[Doubt] = field(default_factory=list)
    """In decreasing order of importance."""
    verdict: str = ""
    """As in the report, such as good for a map, or localized for a drive; empty if there is none."""
    reasons: tuple[str, ...] = ()
    """Sentences for the verdict."""
    expected: str = ""
    """Errors to expect, in words."""

    @property
    def seconds(self) -> NDArray[np.float64]:
        """(S,) since the start, of each pose of the trajectory."""
        return self.seconds_of(self.trajectory.stamps)

    def seconds_of(self, stamps: NDArray[np.int64]) -> NDArray[np.float64]:
        """(N,) seconds since the start at stamps (N,)."""
        seconds: NDArray[np.float64] = (stamps - self.trajectory.stamps[0]) * 1e-9
        return seconds

    @property
    def poses_of_sights(self) -> Pose:
        """(N, 3) the car's pose at each scan."""
        stamps = np.array([sight.stamp for sight in self.sights], dtype=np.int64)
        scans = np.searchsorted(self.trajectory.stamps, stamps, side="right") - 1
        return self.trajectory.map_from_base[np.maximum(scans, 0)]

    @property
    def deviations(self) -> NDArray[np.float64]:
        """(S, 2) standard deviations of position (m) and heading (rad) at each pose of the trajectory."""
        variances = np.diagonal(self.covariances, axis1=1, axis2=2)
        deviations: NDArray[np.float64] = np.sqrt(
            np.column_stack([variances[:, 0] + variances[:, 1], variances[:, 2]])
        )
        return deviations
