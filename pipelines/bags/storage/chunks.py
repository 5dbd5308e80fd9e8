"""Bag files read chunk by chunk, with or without their index.

A recorder only appends, so a file that lost its end still has complete chunks. A short pass over it finds
which messages each chunk has, and the time they span. The chunks can then be loaded in time order: memory
holds only those that overlap, however long the bag.
"""

import heapq
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count, pairwise, zip_longest
from pathlib import Path

from racecar.pipelines.bags.storage.compression import Allowance, decompress_what_is_there
from racecar.pipelines.bags.storage.recorder_clock import MOST_SET_BACK, SET_BACK, set_backs

RawMessage = tuple[str, int, bytes]
"""Topic, recording time in nanoseconds, serialized message."""
_MOST_HELD = 128 << 20
"""Limit in bytes on messages held back for chunks that begin before them, so memory suffices. A second of
many lasers takes a hundredth of it."""


@dataclass(frozen=True)
class BagTopic:
    """A topic of a bag."""

    name: str
    message_type: str
    """As in ROS 2, such as ``sensor_msgs/msg/LaserScan``."""
    encoding: str
    """``cdr`` or ``ros1``."""
    message_count: int = 0

    def takes(self, other: "BagTopic") -> bool:
        """Whether the other topic has the same name, type and encoding."""
        names = other.name, other.message_type, other.encoding
        return names == (self.name, self.message_type, self.encoding)


@dataclass
class Chunk:
    """A segment of a file, and the messages in it."""

    begin: int
    """Byte (or page) where the messages begin."""
    size: int
    """Bytes (or pages)."""
    compression: str = ""
    start_time: int = 2**63 - 1
    end_time: int = -1
    counts: Counter[int] = field(default_factory=Counter)
    """Messages by channel id."""
    goes_back: bool = False
    """Whether the time of a channel goes back, in it or since an earlier chunk."""
    delay: int = 0
    """Nanoseconds by which the recorder's clock had been set back before."""
    set_backs: list[tuple[int, int]] = field(default_factory=list)
    """Where it was set back in this chunk, as `recorder_clock.set_backs` of its messages."""

    def postpone(self, nanoseconds: int) -> None:
        """Add to all times."""
        self.delay += nanoseconds
        self.start_time += nanoseconds
        self.end_time += nanoseconds

    def steady(self, index: int, time: int) -> int:
        """The time of a message as if the recorder's clock had never been set back."""
        return time + self.delay + sum(by for first, by in self.set_backs if index >= first)

    def note(self, channel: int, first_time: int, last_time: int, count: int = 1) -> None:
        """Add ``count`` messages of a channel."""
        self.counts[channel] += count
        self.start_time = min(self.start_time, first_time)
        self.end_time = max(self.end_time, last_time)


@dataclass(frozen=True)
class Damage:
    """What is missing from a file."""

    file_name: str
    cause: str
    """A clause, such as "is cut off"."""
    bytes_read: int
    bytes_expected: int | None
    """None if the file does not state it."""

    def __str__(self) -> str:
        read = self.bytes_read / 1e6
        if self.bytes_expected is None:
            return f"{self.file_name} {self.cause}, after {read:.1f} MB; how much is missing is not known."
        if self.bytes_read >= self.bytes_expected:
            return f"{self.file_name} {self.cause}."
        lost, expected = 1 - self.bytes_read / self.bytes_expected, self.bytes_expected / 1e6
        return (
            f"{self.file_name} {self.cause}: {lost:.0%} of its bytes are lost "
            f"({read:.1f} of {expected:.1f} MB could be read)."
        )


class BagFile(ABC):
    """One file of a bag; subclasses implement the format."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.damage: Damage | None = None
        """What is missing; known once everything was read, if not earlier."""
        self.set_backs: list[tuple[int, int]] = []
        """When the recorder's clock was set back, in the steady time of the messages, and the step; in
        nanoseconds."""

    def delay(self, nanoseconds: int) -> None:
        """Add to all times, as the recorder's clock was set back in an earlier file."""
        self.set_backs = [(time + nanoseconds, by) for time, by in self.set_backs]

    @property
    @abstractmethod
    def topics(self) -> list[BagTopic]:
        """Topics with their numbers of readable messages; a name may occur several times."""

    @property
    @abstractmethod
    def start_time(self) -> int:
        """Recording time of the first message in nanoseconds; 0 if there is none."""

    @abstractmethod
    def messages(self, topics: Mapping[str, BagTopic]) -> Iterator[RawMessage]:
        """Messages of these topics, by name, in order of recording time."""

    @property
    @abstractmethod
    def unreadable_messages(self) -> int:
        """Messages that the file announced but that could not be read; grows while reading."""

    @abstractmethod
    def close(self) -> None:
        """Close the file."""


class ChunkedFile(BagFile):
    """A bag file as a list of chunks."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.channels: dict[int, BagTopic] = {}
        self.chunks: list[Chunk] = []
        self._lost: dict[tuple[int, int], int] = {}
        self._latest: dict[int, int] = {}
        self._file = path.open("rb")
        self._file_size = path.stat().st_size

    def close(self) -> None:
        """As in the base class."""
        self._file.close()

    @property
    def topics(self) -> list[BagTopic]:
        """As in the base class."""
        counts: Counter[int] = Counter()
        for chunk in self.chunks:
            counts.update(chunk.counts)
        return [
            BagTopic(topic.name, topic.message_type, topic.encoding, counts[channel])
            for channel, topic in self.channels.items()
        ]

    @property
    def start_time(self) -> int:
        """As in the base class."""
        return min((chunk.start_time for chunk in self.chunks if chunk.counts), default=0)

    def messages(self, topics: Mapping[str, BagTopic]) -> Iterator[RawMessage]:
        """As in the base class."""
        wanted = {
            channel: topic.name
            for channel, topic in self.channels.items()
            if topic.name in topics and topics[topic.name].takes(topic)
        }
        chunks = sorted(
            (chunk for chunk in self.chunks if not wanted.keys().isdisjoint(chunk.counts)),
            key=lambda chunk: chunk.start_time,
        )
        waiting: list[tuple[int, int, int, bytes]] = []
        held, arrivals, allowance = 0, count(), Allowance(self._file_size)
        for chunk, following in zip_longest(chunks, chunks[1:]):
            loaded = self._load(chunk, wanted, allowance)
            self._note_losses(chunk, wanted, Counter(channel for _, channel, _ in loaded))
            for time, channel, data in loaded:
                heapq.heappush(waiting, (time, next(arrivals), channel, data))
                held += len(data)
            del loaded
            while waiting and (
                following is None or waiting[0][0] < following.start_time or held > _MOST_HELD
            ):
                time, _, channel, data = heapq.heappop(waiting)
                held -= len(data)
                yield wanted[channel], time, data

    @property
    def unreadable_messages(self) -> int:
        """As in the base class."""
        return sum(self._lost.values())

    def delay(self, nanoseconds: int) -> None:
        """As in the base class."""
        super().delay(nanoseconds)
        for chunk in self.chunks:
            chunk.postpone(nanoseconds)

    def _note(self, chunk: Chunk, channel: int, times: Sequence[int]) -> None:
        """Add a channel's messages to a chunk, in the order of the file."""
        line = [self._latest.get(channel, times[0]), *times]
        chunk.goes_back = chunk.goes_back or any(after < time - SET_BACK for time, after in pairwise(line))
        self._latest[channel] = times[-1]
        chunk.note(channel, min(times), max(times), len(times))

    def _follow_clock(self, allowance: Allowance) -> None:
        """Find out where the recorder's clock was set back, and delay what follows."""
        doubtful = [number for number, chunk in enumerate(self.chunks) if chunk.goes_back]
        for number in doubtful[:MOST_SET_BACK]:
            before = self._moments(self.chunks[number - 1], allowance) if number else []
            here = self._moments(self.chunks[number], allowance)
            after = self._moments(self.chunks[number + 1], allowance) if self.chunks[number + 1 :] else []
            for index, by in set_backs([*before, *here, *after]):
                if 0 <= (first := index - len(before)) < len(here):
                    chunk = self.chunks[number]
                    chunk.set_backs.append((first, by))
                    times = [chunk.steady(at, time) for at, (_, time) in enumerate(here)]
                    chunk.start_time, chunk.end_time = min(times), max(times)
                    self.set_backs.append((times[first], by))
                    for later in self.chunks[number + 1 :]:
                        later.postpone(by)

    def _moments(self, chunk: Chunk, allowance: Allowance) -> list[tuple[int, int]]:
        """Channel and time of the messages in a chunk, in the order of the file."""
        found = self._messages_in(self._content(chunk, allowance))
        return [(channel, time) for time, channel, _ in found]

    def _note_losses(self, chunk: Chunk, wanted: Collection[int], loaded: Counter[int]) -> None:
        for channel in wanted:
            if loaded[channel] < chunk.counts[channel]:
                self._lost[chunk.begin, channel] = chunk.counts[channel] - loaded[channel]

    def _load(
        self, chunk: Chunk, wanted: Collection[int], allowance: Allowance
    ) -> list[tuple[int, int, bytes]]:
        """Time, channel and content of readable messages in a chunk, for the wanted channels."""
        found = self._messages_in(self._content(chunk, allowance))
        return [
            (chunk.steady(index, time), channel, bytes(data))
            for index, (time, channel, data) in enumerate(found)
            if channel in wanted
        ]

    def _messages_in(self, content: bytes | bytearray) -> Iterator[tuple[int, int, memoryview]]:
        """Time, channel and content of readable messages in the content of a chunk."""
        raise NotImplementedError

    def _content(self, chunk: Chunk, allowance: Allowance) -> bytes | bytearray:
        data = self._read_at(chunk.begin, chunk.size)
        return decompress_what_is_there(data, chunk.compression, allowance)

    def _read_at(self, begin: int, size: int) -> bytes:
        """Read those of these bytes that exist; a damaged length may announce any number of them."""
        if not 0 <= begin < self._file_size:
            return b""
        self._file.seek(begin)
        return self._file.read(min(size, self._file_size - begin))
