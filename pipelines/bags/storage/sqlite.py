"""ROS 2 sqlite bags, read by SQLite as long as possible, and then page by page."""

import logging
import shutil
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from racecar.pipelines.bags.storage.chunks import BagFile, BagTopic, RawMessage
from racecar.pipelines.bags.storage.compression import require_space
from racecar.pipelines.bags.storage.recorder_clock import MOST_SET_BACK, SET_BACK, set_backs
from racecar.pipelines.bags.storage.sqlite_pages import SqlitePages

_log = logging.getLogger(__name__)

_ROWS_AROUND = 100
"""Rows before and after one, enough to see whether a clock was set back there."""


def open_sqlite(path: Path) -> BagFile:
    """Open a ``.db3`` file."""
    try:
        return SqliteFile(path)
    except sqlite3.Error as error:
        _log.info("%s: %s; reading its pages", path, error)
        return SqlitePages(path)


def has_log(path: Path) -> bool:
    """Whether a file has a write-ahead log. It contains the newest messages of a bag that was copied while
    being recorded, or whose recorder was killed."""
    log = _log_of(path)
    return log.is_file() and log.stat().st_size > 0


def with_log(path: Path, folder: Path) -> Path:
    """A copy with the log applied by SQLite. Raises UserError when there is no room for it."""
    require_space(folder, path.stat().st_size + 2 * _log_of(path).stat().st_size, path)
    copy = folder / path.name
    shutil.copyfile(path, copy)
    shutil.copyfile(_log_of(path), _log_of(copy))
    # If the database is damaged, readers use what is there.
    with suppress(sqlite3.Error), closing(sqlite3.connect(copy)) as connection:
        connection.execute("PRAGMA trusted_schema = OFF")
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    return copy


def _log_of(path: Path) -> Path:
    return path.with_name(path.name + "-wal")


class SqliteFile(BagFile):
    """The tables ``topics`` and ``messages``; raises sqlite3.Error if they cannot be read at all."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._pages: SqlitePages | None = None
        self._read = self._announced = 0
        self._time = "timestamp"
        """SQL for the steady time of a message."""
        # Immutable: takes no lock and writes nothing next to the file.
        address = f"{path.absolute().as_uri()}?mode=ro&immutable=1"
        self._connection = sqlite3.connect(address, uri=True, check_same_thread=False)
        self._connection.text_factory = bytes
        try:
            self._connection.execute("PRAGMA trusted_schema = OFF")
            self._require_tables()
            self._topics = self._topics_by_number()
            self._follow_clock()
            ((start_time,),) = self._rows(f"SELECT MIN({self._time}) FROM messages")
            self._start_time = start_time if isinstance(start_time, int) else 0
        except BaseException:
            self._connection.close()
            raise

    @property
    def topics(self) -> list[BagTopic]:
        """As in the base class."""
        return list(self._topics.values())

    @property
    def start_time(self) -> int:
        """As in the base class."""
        return self._start_time

    @property
    def unreadable_messages(self) -> int:
        """As in the base class."""
        return max(self._announced - self._read, 0)

    def messages(self, topics: Mapping[str, BagTopic]) -> Iterator[RawMessage]:
        """As in the base class."""
        wanted = {
            number: topic
            for number, topic in self._topics.items()
            if topic.name in topics and topics[topic.name].takes(topic)
        }
        places = ",".join("?" * len(wanted))
        query = f"SELECT topic_id, {self._time} AS time, data FROM messages WHERE topic_id IN ({places})"
        last_time = read = 0
        try:
            for number, time, data in self._rows(f"{query} ORDER BY time, rowid", list(wanted)):
                if isinstance(time, int) and isinstance(data, bytes):
                    last_time, read = time, read + 1
                    yield wanted[number].name, time, data
        except sqlite3.Error as error:
            _log.info("%s: %s; going on page by page", self.path, error)
            for message in self._salvage().messages(topics):
                if message[1] > last_time:
                    read += 1
                    yield message
        self._read, self._announced = read, sum(topic.message_count for topic in wanted.values())

    def close(self) -> None:
        """As in the base class."""
        self._connection.close()
        if self._pages is not None:
            self._pages.close()

    def delay(self, nanoseconds: int) -> None:
        """As in the base class."""
        super().delay(nanoseconds)
        self._time = f"({self._time} + {nanoseconds})"
        self._start_time += nanoseconds

    def _follow_clock(self) -> None:
        """Find out where the recorder's clock was set back, and delay what follows."""
        steps = "SELECT rowid, timestamp - LAG(timestamp) OVER (ORDER BY rowid) AS step FROM messages"
        backwards = f"SELECT rowid FROM ({steps}) WHERE step < {-SET_BACK} LIMIT {MOST_SET_BACK}"
        around = (
            "SELECT rowid, topic_id, timestamp FROM messages WHERE rowid BETWEEN ? AND ? "
            "AND TYPEOF(topic_id) = 'integer' AND TYPEOF(timestamp) = 'integer' ORDER BY rowid"
        )
        delay = 0
        for (row,) in list(self._rows(backwards)):
            rows = list(self._rows(around, [row - _ROWS_AROUND, row + _ROWS_AROUND]))
            for index, by in set_backs([(topic, time) for _, topic, time in rows]):
                if rows[index][0] == row:
                    delay += by
                    self._time += f" + (rowid >= {row}) * {by}"
                    self.set_backs.append((rows[index][2] + delay, by))

    def _salvage(self) -> SqlitePages:
        if self._pages is None:
            self._pages = SqlitePages(self.path)
            self.damage = self._pages.damage
        return self._pages

    def _require_tables(self) -> None:
        """Reject anything else with their names, such as a view, which could take forever."""
        query = "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name IN ('topics', 'messages')"
        ((count,),) = self._rows(query)
        if count != 2:
            raise sqlite3.DatabaseError("it lacks a bag's tables")

    def _topics_by_number(self) -> dict[int, BagTopic]:
        sizes = "SELECT topic_id, COUNT(*), SUM(LENGTH(data)) FROM messages GROUP BY topic_id"
        counts, size = {}, 0
        for number, count, size_of_topic in self._rows(sizes):
            counts[number] = count
            size += size_of_topic or 0
        if size > self.path.stat().st_size:
            raise sqlite3.DatabaseError("its messages are larger than the file")
        return {
            number: BagTopic(_text(name), _text(message_type), _text(encoding), counts.get(number, 0))
            for number, name, message_type, encoding in self._rows(
                "SELECT id, name, type, serialization_format FROM topics ORDER BY id"
            )
            if isinstance(number, int)
        }

    def _rows(self, query: str, values: list[int] | None = None) -> Iterator[tuple[Any, ...]]:
        try:
            yield from self._connection.execute(query, values or [])
        except UnicodeDecodeError as error:  # sqlite3 cannot format an error that quotes a damaged name
            raise sqlite3.DatabaseError("its schema is damaged") from error


def _text(value: object) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)
