"""The first messages of a topic, examined before the bag is read."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from racecar.pipelines.bags.converters.registry import Converter, stamp_of
from racecar.pipelines.bags.messages import POINT_CLOUD, decode, frame_name
from racecar.pipelines.bags.storage.chunks import BagTopic
from racecar.pipelines.bags.storage.store import BagStore

_COUNT = 25
"""Messages examined in advance: enough for the median of their spacing, and read instantly."""
_LARGEST, _LARGEST_CLOUD = 1 << 20, 72 << 20
"""Bytes of a message. The finest planar scanners have 25 000 beams of 8 bytes, and the finest depth cameras
1920 x 1080 points of 32 bytes. Larger messages would cost minutes and gigabytes."""


@dataclass(frozen=True)
class Samples:
    """The first messages of a topic, with their recording times and header stamps."""

    topic: BagTopic
    recorded: list[int]
    headers: list[int]
    messages: list[Any]

    @property
    def clock_offset(self) -> int | None:
        """Nanoseconds by which headers are ahead of their recording times; None if they have no time."""
        if len(set(self.headers)) < min(len(self.headers), 2) or not any(self.headers):
            return None
        offsets = sorted(
            header - recorded
            for header, recorded in zip(self.headers, self.recorded, strict=True)
            if header > 0
        )
        return offsets[len(offsets) // 2] if offsets else None

    @property
    def frames(self) -> list[str]:
        return [frame_name(message.header.frame_id) for message in self.messages]

    def gap(self, frame: str) -> float:
        """Seconds between the scans of one frame, or of all if it is not among them."""
        stamps = self.headers if self.clock_offset else self.recorded
        of_frame = [stamp for stamp, each in zip(stamps, self.frames, strict=True) if each == frame]
        steps = np.diff(sorted(of_frame if len(of_frame) > 1 else stamps))
        return float(np.median(steps)) * 1e-9 if len(steps) else float("inf")


def first_samples(store: BagStore, topic: BagTopic, converter: Converter[Any] | None = None) -> Samples:
    """The first messages of a topic that a converter uses."""
    recorded, headers, messages = [], [], []
    for _, time, message in decoded(store, [topic.name]):
        header = stamp_of(message, converter)
        if header is not None:
            recorded.append(time)
            headers.append(header)
            messages.append(message)
        if len(messages) == _COUNT:
            break
    return Samples(topic, recorded, headers, messages)


def decoded(
    store: BagStore, names: Sequence[str], counts: Counter[str] | None = None
) -> Iterator[tuple[str, int, Any]]:
    """Topic, recording time and content of the messages that can be decoded; others are counted."""
    counts = Counter() if counts is None else counts
    names = [name for name in names if store.topics[name].message_count]
    for name, recorded, data in store.messages(names) if names else ():
        message = decode_or_count(store.topics[name], data, counts)
        if message is not None:
            yield name, recorded, message


def decode_or_count(topic: BagTopic, data: bytes, counts: Counter[str]) -> Any | None:
    """The message; None if it is damaged or larger than any sensor's, which is counted."""
    if len(data) > (_LARGEST_CLOUD if topic.message_type == POINT_CLOUD else _LARGEST):
        counts["oversized_messages"] += 1
        return None
    try:
        return decode(topic, data)
    except Exception:  # any error that deserializing damaged bytes raises
        counts["undecodable_messages"] += 1
        return None
