"""Bag files read chunk by chunk, with or without their index.

A recorder appends; what is written stays where it is. So a file that lost its end still holds whole
chunks, and a short pass over it shows which messages each chunk holds and from when to when. With
that, the chunks can be loaded one after the other in the order of time: memory holds the chunks that
overlap, however long the bag.
"""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

RawMessage = tuple[str, int, bytes]
"""Topic, time of recording in nanoseconds, serialized message."""


@dataclass(frozen=True)
class BagTopic:
    """A topic of a bag."""

    name: str
    message_type: str
    """In the ROS 2 manner, such as ``sensor_msgs/msg/LaserScan``."""
    encoding: str
    """``cdr`` or ``ros1``."""
    message_count: int = 0


@dataclass
class Chunk:
    """A segment of a file, and which messages it holds."""

    begin: int
    """Byte (or page) at which the messages begin."""
    size: int
    """Bytes (or pages)."""
    compression: str = ""
    start_time: int = 2**63 - 1
    end_time: int = -1
    counts: Counter[int] = field(default_factory=Counter)
    """Messages by channel id."""

    def note(self, channel: int, first_time: int, last_time: int, count: int = 1) -> None:
        """Take into account ``count`` messages of a channel."""
        self.counts[channel] += count
        self.start_time = min(self.start_time, first_time)
        self.end_time = max(self.end_time, last_time)


@dataclass(frozen=True)
class Damage:
    """What a file lost."""

    file_name: str
    cause: str
    """A clause, such as "is cut off"."""
    bytes_read: int
    bytes_expected: int | None
    """None where the file does not say."""


class ChunkedFile(ABC):
    """A bag file as a list of chunks; subclasses know the format."""

    name: ClassVar[str]
    """Of the format, for people."""
    magic: ClassVar[bytes]
    """With which every file of the format begins."""
    suffix: ClassVar[str]
    """Of file names."""
    is_ros2: ClassVar[bool]
    """Whether such files make up ROS 2 bags, which ``rosbags`` opens while they are whole."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.channels: dict[int, BagTopic] = {}
        self.chunks: list[Chunk] = []
        self.damage: Damage | None = None
        self._lost: dict[tuple[int, int], int] = {}
        self._file = path.open("rb")
        self._file_size = path.stat().st_size

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    @property
    def topics(self) -> list[BagTopic]:
        """The channels, with the number of readable messages."""
        counts: Counter[int] = Counter()
        for chunk in self.chunks:
            counts.update(chunk.counts)
        return [
            BagTopic(topic.name, topic.message_type, topic.encoding, counts[channel])
            for channel, topic in self.channels.items()
        ]

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """The messages of these topics in the order of their recording times."""
        wanted = {channel: topic.name for channel, topic in self.channels.items() if topic.name in topics}
        chunks = sorted(
            (chunk for chunk in self.chunks if not wanted.keys().isdisjoint(chunk.counts)),
            key=lambda chunk: chunk.start_time,
        )
        waiting: list[tuple[int, int, bytes]] = []
        for chunk, following in zip(chunks, [*chunks[1:], None], strict=True):
            loaded = self._load(chunk, wanted)
            self._note_losses(chunk, wanted, Counter(channel for _, channel, _ in loaded))
            waiting += loaded
            waiting.sort(key=lambda message: message[0])
            later = []
            for message in waiting:
                if following is None or message[0] < following.start_time:
                    yield wanted[message[1]], message[0], message[2]
                else:
                    later.append(message)
            waiting = later

    @property
    def unreadable_messages(self) -> int:
        """Messages that the file announced and that could not be read after all; grows while reading."""
        return sum(self._lost.values())

    def _note_losses(self, chunk: Chunk, wanted: Collection[int], loaded: Counter[int]) -> None:
        for channel in wanted:
            if loaded[channel] < chunk.counts[channel]:
                self._lost[chunk.begin, channel] = chunk.counts[channel] - loaded[channel]

    @abstractmethod
    def _load(self, chunk: Chunk, wanted: Collection[int]) -> list[tuple[int, int, bytes]]:
        """Time, channel and content of the wanted channels' readable messages in a chunk."""

    def _read_at(self, begin: int, size: int) -> bytes:
        self._file.seek(begin)
        return self._file.read(size)
