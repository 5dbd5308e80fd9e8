"""A person who walks behind the car all the time, as who drives it from a remote control does."""

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.simulation.driver import TICK, CarMotion
from racecar.pipelines.simulation.walkers import legs_of

_STEP = 10
"""Ticks from one place of the person to the next."""
_DISTANCE, _SWAY, _PERIOD = 2.5, 0.5, 7.0
"""Metres behind the car, more or less, and the seconds in which that changes there and back."""
_NEAREST = 1.0
"""Metres to which a car that reverses may come before the person gives way."""


class Follower:
    """Where a person's legs are who keeps 2 to 3 m behind a car, by the shortest way."""

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
