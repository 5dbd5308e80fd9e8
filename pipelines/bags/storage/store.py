"""A bag of any kind as topics and raw messages."""

import logging
import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml
from rosbags.interfaces import Connection, ConnectionExtRosbag2
from rosbags.rosbag2 import Reader

from racecar.maps.errors import UserError
from racecar.pipelines.bags.storage.chunks import BagTopic, ChunkedFile, Damage, RawMessage
from racecar.pipelines.bags.storage.formats import FORMATS, ROS2_SUFFIXES, file_format
from racecar.pipelines.bags.storage.losses import describe_losses

_log = logging.getLogger(__name__)


class _WholeBag:
    """A ROS 2 bag that ``rosbags`` opens; should that fail halfway, the rest is salvaged."""

    def __init__(self, path: Path, files: Sequence[Path]) -> None:
        self._files = files
        self._reader = Reader(path)
        self._reader.open()
        self.damages: dict[Path, Damage] = {}
        self.unreadable_messages = 0
        self.topics = [_topic_of(connection) for connection in self._reader.connections]

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        connections = [connection for connection in self._reader.connections if connection.topic in topics]
        if not connections:
            return
        last_time, read = -1, 0
        try:
            for connection, last_time, data in self._reader.messages(connections):
                read += 1
                yield connection.topic, last_time, data
            return
        except Exception as error:  # whatever rosbags, sqlite and the decompressors raise on damaged bytes
            _log.info("%s: %s; going on by salvage", self._reader.path, error)
        for file in self._files:
            salvaged = file_format(file)(file)
            for message in salvaged.messages(topics):
                if message[1] > last_time:
                    read += 1
                    yield message
            size = file.stat().st_size
            self.damages[file] = salvaged.damage or Damage(file.name, "is damaged inside", size, size)
            salvaged.close()
        self.unreadable_messages = sum(connection.msgcount for connection in connections) - read

    def close(self) -> None:
        self._reader.close()


def _topic_of(connection: Connection) -> BagTopic:
    ext = connection.ext
    encoding = ext.serialization_format if isinstance(ext, ConnectionExtRosbag2) else "ros1"
    return BagTopic(connection.topic, connection.msgtype, encoding, connection.msgcount)


class BagStore:
    """Topics and messages of a ROS 1 ``.bag``, a ROS 2 bag folder, or a lone ``.db3`` or ``.mcap``.

    Raises UserError when the path holds no bag.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._messages_expected: int | None = None
        self._parts: list[_WholeBag | ChunkedFile] = []
        if not path.exists():
            raise UserError(f"{path} does not exist.")
        if path.is_dir():
            self._open_folder()
        else:
            self._parts.append(_open_file(path))
        self.topics = self._merged_topics()
        """By name."""

    def close(self) -> None:
        """Close the files."""
        for part in self._parts:
            part.close()

    @property
    def losses(self) -> list[str]:
        """Sentences about what is damaged; more may come to light while reading."""
        damages: list[Damage] = []
        for part in self._parts:
            if isinstance(part, _WholeBag):
                damages += part.damages.values()
            elif part.damage is not None:
                damages.append(part.damage)
        read = sum(topic.message_count for topic in self.topics.values())
        if self.unreadable_messages and not damages:
            damages.append(Damage(self.path.name, "is damaged inside", 0, 0))
        expected = self._messages_expected or (read if self.unreadable_messages else None)
        return describe_losses(damages, read - self.unreadable_messages, expected)

    @property
    def unreadable_messages(self) -> int:
        """Messages that were announced and could not be read, as far as the bag was read."""
        return sum(part.unreadable_messages for part in self._parts)

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """The messages of these topics, in the order of recording."""
        for part in self._parts:
            yield from part.messages(topics)

    def _open_folder(self) -> None:
        metadata = _read_metadata(self.path)
        files = _files_of(self.path, metadata)
        if metadata:
            self._messages_expected = metadata.get("message_count")
            try:
                self._parts.append(_WholeBag(self.path, files))
                return
            except Exception as error:  # as above
                _log.info("%s: %s; opening its files one by one", self.path, error)
        for file in files:
            try:
                self._parts.append(_open_file(file))
            except UserError:
                if len(files) == 1:
                    raise
                _log.warning("%s holds nothing readable", file)

    def _merged_topics(self) -> dict[str, BagTopic]:
        merged: dict[str, BagTopic] = {}
        for part in self._parts:
            for topic in part.topics:
                count = topic.message_count + (
                    merged[topic.name].message_count if topic.name in merged else 0
                )
                merged[topic.name] = BagTopic(topic.name, topic.message_type, topic.encoding, count)
        return merged


def _open_file(path: Path) -> _WholeBag | ChunkedFile:
    reader = file_format(path)
    if reader.is_ros2:
        try:
            return _WholeBag(path, [path])
        except Exception as error:  # as above
            _log.info("%s: %s; salvaging", path, error)
    return reader(path)


def _read_metadata(folder: Path) -> dict[str, Any]:
    """The content of metadata.yaml; empty where it is missing or broken."""
    try:
        content = yaml.safe_load((folder / "metadata.yaml").read_text())
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return {}
    information = content.get("rosbag2_bagfile_information") if isinstance(content, dict) else None
    return information if isinstance(information, dict) else {}


def _files_of(folder: Path, metadata: dict[str, Any]) -> list[Path]:
    """The bag files in a folder, in the order of recording. Raises UserError when there are none."""
    named = [folder / Path(name).name for name in metadata.get("relative_file_paths") or ()]
    files = [file for file in named if file.exists()]
    if not files:
        files = [file for file in folder.iterdir() if file.suffix in ROS2_SUFFIXES]
        files.sort(
            key=lambda file: [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", file.name)]
        )
    if files:
        return files
    ros1_suffixes = [reader.suffix for reader in FORMATS if not reader.is_ros2]
    ros1_bags = sorted(file.name for file in folder.iterdir() if file.suffix in ros1_suffixes)
    if ros1_bags:
        raise UserError(f"{folder} is a folder of ROS 1 bags: name one of them ({', '.join(ros1_bags[:5])}).")
    raise UserError(f"{folder} holds no bag: neither {' nor '.join(ROS2_SUFFIXES)} files are in it.")
