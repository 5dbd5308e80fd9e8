"""A bag of any format as topics and raw messages."""

import heapq
import logging
from collections import deque
from collections.abc import Collection, Iterator
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from racecar.maps.errors import UserError
from racecar.maps.whole_folders import finish_replacing
from racecar.pipelines.bags.storage.chunks import BagFile, BagTopic, Damage, RawMessage
from racecar.pipelines.bags.storage.compression import (
    ZSTD_MAGIC,
    Allowance,
    decompress_what_is_there,
    unpack,
)
from racecar.pipelines.bags.storage.folder import METADATA, BagFolder, read_folder
from racecar.pipelines.bags.storage.formats import file_format, is_packed
from racecar.pipelines.bags.storage.recorder_clock import LATEST
from racecar.pipelines.bags.storage.sqlite import has_log, with_log
from racecar.sensors.findings import Finding

_log = logging.getLogger(__name__)


class BagStore:
    """Topics and messages of a ROS 1 ``.bag``, a ROS 2 bag folder, or a single ``.db3`` or ``.mcap``.

    Files and messages may be compressed. Never writes next to the bag. Raises UserError when the path is not
    a bag.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._folder = BagFolder([path])
        self._parts: list[BagFile] = []
        self._stack = ExitStack()
        self._damages: list[Damage] = []
        finish_replacing(path)
        if not path.exists():
            raise UserError(f"{path} does not exist.")
        try:
            self._open()
        except BaseException:
            self.close()
            raise
        delay = 0
        for part in self._parts:
            part.delay(delay)
            delay += sum(by for _, by in part.set_backs)
        self._parts.sort(key=lambda part: part.start_time)
        self._all_topics = [topic for part in self._parts for topic in part.topics]
        self.topics = _merged(self._all_topics)
        """Topics by name."""

    def close(self) -> None:
        """Close the files."""
        self._stack.close()

    @property
    def losses(self) -> list[str]:
        """Sentences about damage; reading may add more."""
        damages = self._damages + [part.damage for part in self._parts if part.damage is not None]
        if self.unreadable_messages and not damages:
            damages.append(Damage(self.path.name, "is damaged inside", 0, 0))
        if not damages:
            return []
        announced = sum(topic.message_count for topic in self.topics.values())
        read = announced - self.unreadable_messages
        share = " messages"
        if expected := self._folder.message_count or (announced if self.unreadable_messages else None):
            share = f" of {expected} messages ({read / expected:.0%})"
        *others, last = map(str, damages)
        return [*others, f"{last} {read}{share} of the bag could be read."]

    @property
    def notes(self) -> list[Finding]:
        """Findings about the bag's files even though nothing is lost."""
        notes = []
        for name, files in (
            ("parts_not_named", self._folder.unnamed),
            ("files_not_named", self._folder.others),
        ):
            if files:
                notes.append(Finding(name, metadata=METADATA, names=", ".join(file.name for file in files)))
        for time, by in self.set_backs:
            at = (time - self.start_time) * 1e-9
            notes.append(Finding("recorder_set_back", seconds=by * 1e-9, at=at))
        for topic in self._all_topics:
            main = self.topics[topic.name]
            if topic.message_count and not main.takes(topic):
                notes.append(
                    Finding(
                        "topic_of_two_types",
                        topic=topic.name,
                        read=main.message_type,
                        messages=topic.message_count,
                        left_out=topic.message_type,
                    )
                )
        return notes

    @property
    def set_backs(self) -> list[tuple[int, int]]:
        """When the recorder's clock was set back, and the step; nanoseconds. Later messages are delayed by
        that, so that their times go on."""
        return sorted(each for part in self._parts for each in part.set_backs)

    @property
    def unreadable_messages(self) -> int:
        """Messages that were announced but could not be read, as far as the bag was read."""
        return sum(part.unreadable_messages for part in self._parts)

    @property
    def start_time(self) -> int:
        """Recording time of the first message in nanoseconds; 0 if there is none."""
        return min((part.start_time for part in self._parts if part.start_time > 0), default=0)

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """Messages of these topics, in the order of recording."""
        wanted = {name: self.topics[name] for name in topics if name in self.topics}
        allowance = Allowance(sum(part.path.stat().st_size for part in self._parts))
        for topic, time, data in _in_order_of_time(self._parts, wanted):
            if wanted[topic].encoding == "cdr" and data.startswith(ZSTD_MAGIC):
                data = bytes(decompress_what_is_there(data, "zstd", allowance))
            yield topic, min(max(time, 0), LATEST), data

    def _open(self) -> None:
        if not self.path.is_dir():
            self._open_file(self.path)
            return
        self._folder = read_folder(self.path)
        for name in self._folder.missing:
            self._damages.append(Damage(name, f"is missing, though {METADATA} names it", 0, 0))
        for file in self._folder.files:
            try:
                self._open_file(file)
            except UserError as error:
                if len(self._folder.files) == 1:
                    raise
                _log.info("%s", error)
                self._damages.append(Damage(file.name, "holds nothing readable", 0, 0))

    def _open_file(self, file: Path) -> None:
        if is_packed(file):
            unpacked, is_whole = unpack(file, self._temporary_folder())
            try:
                part = self._open_part(unpacked)
            except UserError as error:
                raise UserError(
                    f"{file} is compressed, and its content is damaged or not a rosbag."
                ) from error
            if not is_whole and part.damage is None:
                part.damage = Damage(file.name, "is damaged", 0, 0)
        else:
            self._open_part(with_log(file, self._temporary_folder()) if has_log(file) else file)

    def _open_part(self, file: Path) -> BagFile:
        part = file_format(file).open(file)
        self._stack.callback(part.close)
        self._parts.append(part)
        return part

    def _temporary_folder(self) -> Path:
        """For files that are made readable, since nothing is written next to a bag; removed on close."""
        return Path(self._stack.enter_context(TemporaryDirectory(prefix="racecar-")))


def _merged(topics: list[BagTopic]) -> dict[str, BagTopic]:
    """Topics by name; if types differ, the one with most messages."""
    counts: dict[tuple[str, str, str], int] = {}
    for topic in topics:
        key = topic.name, topic.message_type, topic.encoding
        counts[key] = counts.get(key, 0) + topic.message_count
    merged: dict[str, BagTopic] = {}
    for key, count in counts.items():
        if key[0] not in merged or count > merged[key[0]].message_count:
            merged[key[0]] = BagTopic(*key, count)
    return merged


def _in_order_of_time(parts: list[BagFile], topics: dict[str, BagTopic]) -> Iterator[RawMessage]:
    """Messages of parts sorted by their start; a part is not read before its time."""
    waiting = deque((part.start_time, number, part) for number, part in enumerate(parts))
    running: list[tuple[int, int, RawMessage, Iterator[RawMessage]]] = []

    def go_on(number: int, messages: Iterator[RawMessage]) -> None:
        for message in messages:
            heapq.heappush(running, (message[1], number, message, messages))
            return

    while waiting or running:
        while waiting and (not running or waiting[0][0] <= running[0][0]):
            _, number, part = waiting.popleft()
            go_on(number, part.messages(topics))
        if running:
            _, number, message, messages = heapq.heappop(running)
            yield message
            go_on(number, messages)
