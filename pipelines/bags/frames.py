"""The frames of a bag, found by reading transforms before the bag itself.

Latched topics are read whole, since they have few messages, some of them late. On other topics the first
minute suffices to distinguish fixed links from moving ones, so a bag of gigabytes is not read twice. Only if
odometry is expected there and the car still stands does reading continue until it moves.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from racecar.pipelines.bags.converters.transforms import FrameLinks, is_latched, namespace_of
from racecar.pipelines.bags.messages import TRANSFORM_TYPES
from racecar.pipelines.bags.storage.chunks import BagTopic

_FIRST_LOOK = 60_000_000_000
"""Nanoseconds of log read first. Publishers repeat fixed links several times a second, and most cars have
started by then. Chosen by judgement."""
_ODOMETRY_APPEARS = 300_000_000_000
"""Nanoseconds until odometry appears on ``/tf``; its driver may start late. Chosen by judgement."""
_CHECKED_EVERY = 500
"""Messages between checks, so looking for odometry costs little compared with reading them."""

Decoded = Callable[[list[str]], Iterable[tuple[str, int, Any]]]
"""Reads topics: name, recording time in nanoseconds and message of each of their messages."""


def transform_topics(topics: Mapping[str, BagTopic], near: str) -> list[list[str]]:
    """Names of transform topics, grouped by robot; the robot that the topic ``near`` belongs to comes first.

    Several robots use the same link names, each in its own namespace, so their topics are kept apart.
    """
    found = [
        topic.name
        for topic in topics.values()
        if topic.message_type in TRANSFORM_TYPES and topic.message_count
    ]
    own = [name for name in found if near.startswith(namespace_of(name) + "/")]
    others = sorted({namespace_of(name) for name in found if name not in own})
    groups = [own, *([name for name in found if namespace_of(name) == each] for each in others)]
    return [group for group in groups if group]


def look_at_links(topics: list[str], decoded: Decoded, sensor_frame: str, wants_odometry: bool) -> FrameLinks:
    """Links on some topics; topics that are not latched are read only as far as needed."""
    links = FrameLinks()
    latched = [name for name in topics if is_latched(name)]
    if latched:
        _take(links, decoded(latched))
    others = [name for name in topics if not is_latched(name)]
    if others:
        _take(links, _until_known(links, decoded(others), sensor_frame, wants_odometry))
    return links


def _take(links: FrameLinks, messages: Iterable[tuple[str, int, Any]]) -> None:
    for topic, _, message in messages:
        for transform in message.transforms:
            links.add(transform, topic)


def _until_known(
    links: FrameLinks, messages: Iterable[tuple[str, int, Any]], sensor_frame: str, wants_odometry: bool
) -> Iterable[tuple[str, int, Any]]:
    first: int | None = None
    for number, (topic, recorded, message) in enumerate(messages):
        first = recorded if first is None else first
        seconds = recorded - first
        if seconds > _FIRST_LOOK and number % _CHECKED_EVERY == 0:
            odometry = links.odometry(sensor_frame) if wants_odometry else None
            is_awaited = odometry is None and seconds < _ODOMETRY_APPEARS
            is_standing = odometry is not None and not odometry.driving.moves
            if not (wants_odometry and (is_awaited or is_standing)):
                return
        yield topic, recorded, message
