"""People who walk in a map: pairs of legs that a laser sees."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.polyline import lengths_along
from racecar.pipelines.simulation.driver import TICK, CarMotion
from racecar.pipelines.simulation.driving_lattice import DrivingLattice

LEG_RADIUS = 0.1
"""Metres, including trousers."""
_SLOWEST, _FASTEST = 0.6, 1.5
"""m/s: a stroll and a brisk walk."""
_CHOICES = 8
"""Places of which a person goes to the nearest, so that most walks are short."""
_LOOK_AHEAD = 0.1
"""Metres along the path over which a person's direction is measured."""
_HALF_GAIT, _STRIDE, _STEP_LENGTH = 0.12, 0.22, 0.7
"""Metres: half the distance between the feet, the lead of a foot, and the length of a step."""
_STEP = 10
"""Ticks between positions of the person."""
_DISTANCE, _SWAY, _PERIOD = 2.5, 0.5, 7.0
"""Metres behind the car, the variation of that, and its period in seconds."""
_NEAREST = 1.0
"""Metres to which a reversing car may approach before the person gives way."""


class Walkers:
    """Walk from place to place on their own paths, ignoring the car."""

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
        """(2 * walkers, 2) positions of the legs in the map, ``seconds`` later."""
        legs = np.empty((len(self._paths), 2, 2))
        for i in range(len(self._paths)):
            self._walked[i] += self._speeds[i] * seconds
            if self._walked[i] >= self._lengths[i][-1]:
                self._set_off(i)
            legs[i] = self._legs(i)
        return legs.reshape(-1, 2)

    def _set_off(self, i: int) -> None:
        """Set off to the nearest of some random places."""
        goals = np.zeros(len(self._lattice.reachable), dtype=np.bool_)
        goals[self._generator.choice(self._nodes, size=_CHOICES)] = True
        goals[self._ends[i]] = False
        nodes = self._lattice.cheapest_path(self._ends[i], goals)
        self._paths[i] = self._lattice.drive(nodes).map_from_base[:, :2]
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
    """(2, 2) the legs of a person at a place (2,) facing a direction (2,), after ``walked`` metres."""
    length = np.linalg.norm(direction)
    forward = direction / length if length > 1e-6 else np.array([1.0, 0.0])
    left = np.array([-forward[1], forward[0]])
    swing = _STRIDE * np.sin(np.pi * walked / _STEP_LENGTH)
    return np.stack(
        [place + _HALF_GAIT * left + swing * forward, place - _HALF_GAIT * left - swing * forward]
    )


class Follower:
    """The legs of a person who follows a car at 2 to 3 m by the shortest path."""

    def __init__(self, drive: CarMotion, generator: np.random.Generator) -> None:
        places = drive.map_from_base[::_STEP, :2]
        phase = generator.uniform(0.0, 2.0 * np.pi)
        kept = _DISTANCE + _SWAY * np.sin(
            2.0 * np.pi / _PERIOD * _STEP * TICK * np.arange(len(places)) + phase
        )
        yaw = drive.map_from_base[0, 2]
        self._places = np.empty_like(places)
        place = places[0] - kept[0] * np.array([np.cos(yaw), np.sin(yaw)])
        for i, car in enumerate(places):
            behind = place - car
            distance = max(float(np.hypot(*behind)), 1e-6)
            place = car + behind * (min(max(distance, _NEAREST), kept[i]) / distance)
            self._places[i] = place
        moves = np.diff(self._places, axis=0, prepend=self._places[:1])
        self._walked = np.cumsum(np.hypot(*moves.T))
        self._car = places

    def legs_at(self, tick: int) -> NDArray[np.float64]:
        """(2, 2) the centres of the legs in the map; the person faces the car."""
        at = min(tick / _STEP, len(self._places) - 1.0)
        i, share = int(at), at - int(at)
        j = min(i + 1, len(self._places) - 1)
        place = (1.0 - share) * self._places[i] + share * self._places[j]
        walked = (1.0 - share) * self._walked[i] + share * self._walked[j]
        return legs_of(place, self._car[i] - place, float(walked))
