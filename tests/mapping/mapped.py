"""Drives through the mapper."""

from collections.abc import Iterable

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.state.result import MappingResult
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan


def mapped(messages: Iterable[Scan | Odometry], config: MappingConfig | None = None) -> MappingResult:
    """The map of a drive."""
    mapper = Mapper(config or MappingConfig())
    for message in messages:
        mapper.add_scan(message) if isinstance(message, Scan) else mapper.add_odometry(message)
    return mapper.finish()


def scans_of(messages: Iterable[Scan | Odometry]) -> list[Scan]:
    """The same drive of a car without wheels that count."""
    return [message for message in messages if isinstance(message, Scan)]
