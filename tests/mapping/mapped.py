"""Drives through the mapper, and how far from the truth they end."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.state.result import MappingResult
from racecar.maps.geometry.se2 import Pose, between
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan


def feed(mapper: Mapper, messages: Iterable[Scan | Odometry]) -> None:
    for message in messages:
        mapper.add_scan(message) if isinstance(message, Scan) else mapper.add_odometry(message)


def mapped(messages: Iterable[Scan | Odometry], config: MappingConfig | None = None) -> MappingResult:
    """The map of a drive."""
    mapper = Mapper(config or MappingConfig())
    feed(mapper, messages)
    return mapper.finish()


def scans_of(messages: Iterable[Scan | Odometry]) -> list[Scan]:
    """The same drive of a car without wheels that count."""
    return [message for message in messages if isinstance(message, Scan)]


def missed(found: Pose, true: Pose) -> NDArray[np.float64]:
    """(N,) metres of poses (N, 3) from the true ones, both seen from their first."""
    error = between(between(true[0], true), between(found[0], found))
    return np.hypot(error[:, 0], error[:, 1])


def errors(result: MappingResult, map_from_base: Pose) -> NDArray[np.float64]:
    """(N,) metres from the truth, of as many scans as there are."""
    return missed(result.trajectory.map_from_base, map_from_base[: len(result.trajectory)])


def mean_error(result: MappingResult, map_from_base: Pose) -> float:
    """Metres, of the same."""
    return float(errors(result, map_from_base).mean())
