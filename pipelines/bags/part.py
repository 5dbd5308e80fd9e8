"""A part of a recording, by the recording times of its messages."""

import math
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass

from racecar.maps.errors import UserError
from racecar.pipelines.bags.storage.chunks import RawMessage
from racecar.pipelines.bags.storage.store import BagStore

_LONGEST = 1e9
"""Seconds, 32 years; their nanoseconds fit into 64 bits."""


@dataclass(frozen=True)
class BagPart:
    """Starts ``start`` seconds after the bag's first message and lasts ``duration`` seconds or to its end."""

    start: float = 0.0
    duration: float | None = None

    def __post_init__(self) -> None:
        """Raises UserError when the numbers are not valid seconds."""
        if not 0.0 <= self.start <= _LONGEST:
            raise UserError(f"The part of the bag cannot start at {self.start:g} s; give 0 s or more.")
        if self.duration is not None and not 0.0 < self.duration < math.inf:
            raise UserError(f"The part of the bag cannot last {self.duration:g} s; give more than 0 s.")

    @property
    def is_whole(self) -> bool:
        """Whether this is the whole bag."""
        return self.start == 0.0 and self.duration is None

    @property
    def words(self) -> str:
        """Description for users."""
        end = "the end" if self.duration is None else f"{self.start + self.duration:g} s"
        return f"{self.start:g} s to {end}"

    def messages(self, store: BagStore, topics: Collection[str]) -> Iterator[RawMessage]:
        """Messages of a bag's topics that were recorded in this part."""
        if self.is_whole:
            yield from store.messages(topics)
            return
        first = store.start_time + round(self.start * 1e9)
        last = None if self.duration is None else first + round(min(self.duration, _LONGEST) * 1e9)
        for message in store.messages(topics):
            if last is not None and message[1] > last:
                return
            if message[1] >= first:
                yield message

    def counts(self, store: BagStore, topics: Collection[str]) -> Counter[str]:
        """Messages by topic; to count those of a part, it is read."""
        if self.is_whole:
            return Counter({name: store.topics[name].message_count for name in topics})
        return Counter(name for name, _, _ in self.messages(store, topics))

    def require(self, store: BagStore, topics: Collection[str]) -> None:
        """Raises UserError when the part has no message of these topics."""
        if not self.is_whole and next(self.messages(store, topics), None) is None:
            times = [time for _, time, _ in store.messages(topics)]
            span = ""
            if times:
                begin, end = ((time - store.start_time) * 1e-9 for time in (times[0], times[-1]))
                span = f", which has scans from {begin:.1f} s to {end:.1f} s"
            raise UserError(f"There is no scan from {self.words} in {store.path}{span}.")
