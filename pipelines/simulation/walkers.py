"""Persons who walk about in a map: pairs of legs that a laser sees."""

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.simulation.driving_lattice import DrivingLattice
from racecar.pipelines.simulation.path_smoothing import lengths_along

LEG_RADIUS = 0.1
"""Metres, trousers included."""
_SLOWEST, _FASTEST = 0.6, 1.5
"""m/s: a stroll and a brisk walk."""
_CHOICES = 8
"""Places among which a person goes to the nearest, so that most walks are short."""
_LOOK_AHEAD = 0.1
"""Metres along the path by which a person's direction is measured."""
_HALF_GAIT, _STRIDE, _STEP_LENGTH = 0.12, 0.22, 0.7
"""Metres: half the space between the feet, how far a foot leads, one step."""


class Walkers:
    """They stroll from one place to another by paths of their own and take no notice of the car."""

    def __init__(self, number: int, lattice: DrivingLattice, generator: np.random.Generator) -> None:
        self._lattice, self._generator = lattice, generator
        self._nodes = np.flatnonzero(lattice.reachable)
        starts = generator.choice(self._nodes, size=number)
        self._speeds = generator.uniform(_SLOWEST, _FASTEST, number)
        self._walked = np.zeros(number)
        self._ends = [int(node) for node in starts]
        self._paths = [lattice.poses_of(np.array([node, node]))[:, :2] for node in starts]
        self._lengths = [np.zeros(2) for _ in starts]

    def walk(self, seconds: float) -> NDArray[np.float64]:
        """(2 * persons, 2) where the legs stand in the map after some more seconds."""
        legs = np.empty((len(self._paths), 2, 2))
        for i in range(len(self._paths)):
            self._walked[i] += self._speeds[i] * seconds
            if self._walked[i] >= self._lengths[i][-1]:
                self._set_off(i)
            legs[i] = self._legs(i)
        return legs.reshape(-1, 2)

    def _set_off(self, i: int) -> None:
        """To the nearest of some other places."""
        goals = np.zeros(len(self._lattice.reachable), dtype=np.bool_)
        goals[self._generator.choice(self._nodes, size=_CHOICES)] = True
        goals[self._ends[i]] = False
        nodes = self._lattice.cheapest_path(self._ends[i], goals)
        self._paths[i] = np.concatenate(
            [self._lattice.poses_of(np.array(nodes[:1]))[:, :2], self._lattice.drive(nodes)[0][:, :2]]
        )
        self._lengths[i] = lengths_along(self._paths[i])
        self._walked[i], self._ends[i] = 0.0, nodes[-1]

    def _legs(self, i: int) -> NDArray[np.float64]:
        walked, path, along = self._walked[i], self._paths[i], self._lengths[i]
        place, ahead = (
            np.array([np.interp(s, along, path[:, 0]), np.interp(s, along, path[:, 1])])
            for s in (walked, walked + _LOOK_AHEAD)
        )
        return legs_of(place, ahead - place, walked)


def legs_of(place: NDArray[np.float64], direction: NDArray[np.float64], walked: float) -> NDArray[np.float64]:
    """(2, 2) the legs of a person at a place (2,) who looks along a direction (2,) and has walked so far."""
    length = np.linalg.norm(direction)
    forward = direction / length if length > 1e-6 else np.array([1.0, 0.0])
    left = np.array([-forward[1], forward[0]])
    swing = _STRIDE * np.sin(np.pi * walked / _STEP_LENGTH)
    return np.stack(
        [place + _HALF_GAIT * left + swing * forward, place - _HALF_GAIT * left - swing * forward]
    )
