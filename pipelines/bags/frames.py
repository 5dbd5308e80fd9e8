"""The frames of a bag: a look at its transforms before it is read.

Latched topics are read whole, since they hold a handful of messages that may come late. Of the others the
first minute is enough to tell fixed links from moving ones, so that a bag of gigabytes need not be read
twice; only where odometry is sought there, and the car stands that long, the look goes on until it moves.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from racecar.pipelines.bags.converters.transforms import FrameLinks, is_latched, namespace_of
from racecar.pipelines.bags.messages import TRANSFORM_TYPES
from racecar.pipelines.bags.storage.chunks import BagTopic

_FIRST_LOOK = 60_000_000_000
"""Nanoseconds of log: publishers of fixed links repeat them several times a second, and most cars have
started by then; by judgement."""
_ODOMETRY_APPEARS = 300_000_000_000
"""Nanoseconds of log in which odometry appears on ``/tf``, whose driver may be started late: by judgement."""
_CHECKED_EVERY = 500
"""Messages, so that the search for odometry costs little beside reading them."""

Decoded = Callable[[list[str]], Iterable[tuple[str, int, Any]]]
"""Topic, recording time in nanoseconds and message, of all messages on some topics."""


def transform_topics(topics: Mapping[str, BagTopic], near: str) -> list[list[str]]:
    """Names of the topics with transforms, those of the robot that another topic belongs to first.

    Several robots publish links of equal names, each in its own namespace; so the topics of one are not
    mixed with those of the others.
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
    """The links on some topics; of those that are not latched as many messages as it takes."""
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
