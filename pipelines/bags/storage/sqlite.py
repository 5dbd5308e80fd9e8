"""ROS 2 sqlite bags, read by SQLite as long as it can."""

import logging
import sqlite3
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from racecar.pipelines.bags.storage.chunks import BagFile, BagTopic, RawMessage
from racecar.pipelines.bags.storage.sqlite_log import log_beside
from racecar.pipelines.bags.storage.sqlite_pages import SqlitePages

_log = logging.getLogger(__name__)


class SqliteFile(BagFile):
    """A ``.db3`` file; what SQLite cannot or must not read is read page by page."""

    name = ".db3"
    magic = b"SQLite format 3\0"
    suffix = ".db3"
    is_ros2 = True

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._pages: SqlitePages | None = None
        self._tables: _Tables | None = None
        self._read = self._announced = 0
        if log := log_beside(path):
            self._pages = SqlitePages(path, log)
            self.damage = self._pages.damage
            return
        try:
            self._tables = _Tables(path)
        except sqlite3.Error as error:
            _log.info("%s: %s; reading its pages", path, error)
            self._salvage()

    @property
    def topics(self) -> list[BagTopic]:
        """As in the base class."""
        if self._tables is not None:
            return list(self._tables.topics.values())
        return self._pages.topics if self._pages else []

    @property
    def start_time(self) -> int:
        """As in the base class."""
        if self._tables is not None:
            return self._tables.start_time
        return self._pages.start_time if self._pages else 0

    @property
    def unreadable_messages(self) -> int:
        """As in the base class."""
        if self._tables is None:
            return self._pages.unreadable_messages if self._pages else 0
        return max(self._announced - self._read, 0)

    def messages(self, topics: Mapping[str, BagTopic]) -> Iterator[RawMessage]:
        """As in the base class."""
        if self._tables is None:
            yield from self._pages.messages(topics) if self._pages else ()
            return
        wanted = {
            number: topic
            for number, topic in self._tables.topics.items()
            if topic.name in topics and topics[topic.name].takes(topic)
        }
        last_time = read = 0
        try:
            for number, last_time, data in self._tables.messages(list(wanted)):
                read += 1
                yield wanted[number].name, last_time, data
        except sqlite3.Error as error:
            _log.info("%s: %s; going on page by page", self.path, error)
            for message in self._salvage().messages(topics):
                if message[1] > last_time:
                    read += 1
                    yield message
        self._read, self._announced = read, sum(topic.message_count for topic in wanted.values())

    def close(self) -> None:
        """As in the base class."""
        if self._pages is not None:
            self._pages.close()
        if self._tables is not None:
            self._tables.close()

    def _salvage(self) -> SqlitePages:
        if self._pages is None:
            self._pages = SqlitePages(self.path)
            self.damage = self._pages.damage
        return self._pages


class _Tables:
    """The tables ``topics`` and ``messages``; all of it raises sqlite3.Error where they are damaged."""

    def __init__(self, path: Path) -> None:
        # Immutable: no lock is taken and nothing is written beside the file.
        address = f"{path.absolute().as_uri()}?mode=ro&immutable=1"
        self._connection = sqlite3.connect(address, uri=True, check_same_thread=False)
        self._connection.text_factory = bytes
        try:
            self._connection.execute("PRAGMA trusted_schema = OFF")
            self._require_tables()
            sizes = "SELECT topic_id, COUNT(*), SUM(LENGTH(data)) FROM messages GROUP BY topic_id"
            counts, size = {}, 0
            for number, count, size_of_topic in self._rows(sizes):
                counts[number] = count
                size += size_of_topic or 0
            if size > path.stat().st_size:
                raise sqlite3.DatabaseError("its messages are larger than the file")
            self.topics = {
                number: BagTopic(_text(name), _text(message_type), _text(encoding), counts.get(number, 0))
                for number, name, message_type, encoding in self._rows(
                    "SELECT id, name, type, serialization_format FROM topics ORDER BY id"
                )
                if isinstance(number, int)
            }
            ((start_time,),) = self._rows("SELECT MIN(timestamp) FROM messages")
            self.start_time = start_time if isinstance(start_time, int) else 0
        except BaseException:
            self._connection.close()
            raise

    def close(self) -> None:
        self._connection.close()

    def messages(self, numbers: list[int]) -> Iterator[tuple[int, int, bytes]]:
        """Topic, time and content in the order of time."""
        places = ",".join("?" * len(numbers))
        query = f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({places})"
        for number, time, data in self._rows(f"{query} ORDER BY timestamp, rowid", numbers):
            if isinstance(time, int) and isinstance(data, bytes):
                yield number, time, data

    def _require_tables(self) -> None:
        """What merely bears their names, such as a view, could take for ever."""
        query = "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name IN ('topics', 'messages')"
        ((count,),) = self._rows(query)
        if count != 2:
            raise sqlite3.DatabaseError("it lacks a bag's tables")

    def _rows(self, query: str, values: list[int] | None = None) -> Iterator[tuple[Any, ...]]:
        try:
            yield from self._connection.execute(query, values or [])
        except UnicodeDecodeError as error:  # sqlite3 cannot word an error that quotes a damaged name
            raise sqlite3.DatabaseError("its schema is damaged") from error


def _text(value: object) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)
