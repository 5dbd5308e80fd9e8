"""People who stand around the car and block its laser."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import wrap_angle
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan

_PERSON_WIDTH = 0.5
"""Shoulder width in metres."""
_NEAREST_PERSON, _FARTHEST_PERSON = 0.7, 4.0
"""Metres from the laser."""
_BEARING_WALK = 0.03
"""Standard deviation of the random walk of a person's bearing from scan to scan, radians."""


def among_people(
    messages: Iterable[Measurement], share: float, rng: np.random.Generator
) -> Iterator[Measurement]:
    """The messages, with a ``share`` of each scan's beams blocked by people."""
    people = np.empty((0, 2))
    for message in messages:
        if not isinstance(message, Scan):
            yield message
            continue
        people[:, 0] = wrap_angle(people[:, 0] + _BEARING_WALK * rng.standard_normal(len(people)))
        while True:
            ranges, hit = _in_front(message, people)
            if hit >= share:
                break
            newcomer = rng.uniform([-np.pi, _NEAREST_PERSON], [np.pi, _FARTHEST_PERSON])
            people = np.vstack([people, newcomer])
        people = people[-200:] if hit < 1.1 * share else people[1:]
        yield replace(message, ranges=ranges)


def _in_front(scan: Scan, people: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Ranges (N,) with people (P, 2) given as bearings and distances, and the share of beams they block."""
    ranges = scan.ranges.copy()
    for bearing, distance in people:
        half = np.arctan(0.5 * _PERSON_WIDTH / distance)
        is_stopped = (np.abs(wrap_angle(scan.bearings - bearing)) < half) & (ranges > distance)
        ranges[is_stopped] = distance
    return ranges, float(np.mean(ranges != scan.ranges))
