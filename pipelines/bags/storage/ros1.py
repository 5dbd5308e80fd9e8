"""ROS 1 bags (format 2.0), intact or truncated.

``rosbags`` keeps an index entry for every message in memory and refuses a bag without its index. This reader
keeps one entry per chunk, which it finds by scanning the file. The format:
http://wiki.ros.org/Bags/Format/2.0
"""

import re
import struct
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
from rosbags.typesys.msg import normalize_msgtype

from racecar.maps.errors import UserError
from racecar.pipelines.bags.storage.chunks import BagTopic, Chunk, ChunkedFile, Damage
from racecar.pipelines.bags.storage.compression import Allowance

_FIRST_LINE = b"#ROSBAG V2.0\n"

_MESSAGE, _BAG_HEADER, _INDEX, _CHUNK, _CONNECTION = 0x02, 0x03, 0x04, 0x05, 0x07
_MESSAGE_OPERATION, _CONNECTION_OPERATION = bytes([_MESSAGE]), bytes([_CONNECTION])
_LONGEST_HEADER = 4096  # bytes; the longest names a topic; more is garbage
_INDEX_ENTRY = 12  # bytes: seconds, nanoseconds, offset
_CHUNK_HEADER = re.compile(
    rb"[\x28\x29]\0\0\0(?:\x04\0\0\0op=\x05|\x09\0\0\0size=....|"
    rb"\x0f\0\0\0compression=(?:bz2|lz4)|\x10\0\0\0compression=none){3}",
    re.DOTALL,
)
"""Its length, and its three fields in any order; no other three such fields have this length."""
_LONGEST_CHUNK_HEADER = 45
_STEP = 1 << 20
"""Bytes searched in one step."""
_GARBAGE = (LookupError, struct.error, ValueError)
"""Errors that parsing damaged bytes raises."""

_uint32 = struct.Struct("<I")
_uint64 = struct.Struct("<Q")
_time = struct.Struct("<II")


def _header_fields(header: bytes | bytearray) -> dict[bytes, bytes]:
    fields, position = {}, 0
    while position + 4 <= len(header):
        end = position + 4 + _uint32.unpack_from(header, position)[0]
        name, _, value = bytes(header[position + 4 : end]).partition(b"=")
        fields[name] = value
        position = end
    return fields


def _records(data: bytes | bytearray) -> Iterator[tuple[dict[bytes, bytes], memoryview]]:
    """Complete records in the content of a chunk: header fields and data."""
    view, position = memoryview(data), 0
    while position + 4 <= len(data):
        data_at = position + 4 + _uint32.unpack_from(data, position)[0]
        if data_at + 4 > len(data):
            return
        end = data_at + 4 + _uint32.unpack_from(data, data_at)[0]
        if end > len(data):
            return
        yield _header_fields(data[position + 4 : data_at]), view[data_at + 4 : end]
        position = end


class Ros1File(ChunkedFile):
    """A ``.bag`` file. Raises UserError when it does not have format 2.0."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._allowance = Allowance(self._file_size)
        self._index_position = 0
        self._expected_chunks = 0
        if self._read_at(0, len(_FIRST_LINE)) != _FIRST_LINE:
            raise UserError(f"{path} is not a ROS 1 bag of format 2.0; `rosbag migrate` converts older ones.")
        end = self._scan(len(_FIRST_LINE))
        self.damage = self._find_damage(end)
        self._follow_clock(self._allowance)

    def _scan(self, position: int) -> int:
        """Find chunks and connections; returns the number of bytes in readable records."""
        skipped = 0
        while position < self._file_size:
            following = self._take_record_at(position)
            if following is None:
                following = self._next_chunk_after(position)
                skipped += self._bytes_of_messages(position, following)
                self._count_messages()
            position = following
        self._count_messages()
        return self._file_size - skipped

    def _bytes_of_messages(self, begin: int, end: int) -> int:
        """Number of these bytes before the index that follows all chunks, whose content is known anyway."""
        index_at = self._index_position if self._index_position > 0 else self._file_size
        return max(min(end, index_at) - begin, 0)

    def _take_record_at(self, position: int) -> int | None:
        """The position after a record; None if there is no record."""
        record = self._record_at(position)
        if record is None:
            return None
        fields, data_at, size = record
        try:
            size = self._size_of_index(fields, data_at, size)
            if data_at + size > self._file_size:  # it is truncated, or its length is damaged
                size = self._next_chunk_after(data_at) - data_at
            self._take(fields, data_at, size)
        except _GARBAGE:
            return None
        return data_at + size

    def _size_of_index(self, fields: dict[bytes, bytes], data_at: int, size: int) -> int:
        """Some recorders wrote a wrong size; rosbag itself uses the count of entries."""
        if fields[b"op"][0] != _INDEX or self._record_at(data_at + size) is not None:
            return size
        counted = _INDEX_ENTRY * _uint32.unpack(fields[b"count"])[0]
        return counted if self._record_at(data_at + counted) is not None else size

    def _next_chunk_after(self, position: int) -> int:
        """Position of the next chunk after damaged bytes, or the end of the file."""
        for begin in range(position + 1, self._file_size, _STEP):
            found = _CHUNK_HEADER.search(self._read_at(begin, _STEP + _LONGEST_CHUNK_HEADER))
            if found:
                return begin + found.start()
        return self._file_size

    def _take(self, fields: dict[bytes, bytes], data_at: int, size: int) -> None:
        operation = fields[b"op"][0]
        if operation == _CHUNK:
            if self.chunks:
                self._learn_channels(self.chunks[-1])
            self.chunks.append(Chunk(data_at, size, fields[b"compression"].decode()))
        elif operation == _BAG_HEADER:
            self._index_position = _uint64.unpack(fields[b"index_pos"])[0]
            self._expected_chunks = _uint32.unpack(fields[b"chunk_count"])[0]
        elif operation == _INDEX and self.chunks:
            self._take_index(fields, self._read_at(data_at, size))
        elif operation == _CONNECTION:
            self._take_connection(fields, self._read_at(data_at, size))

    def _record_at(self, position: int) -> tuple[dict[bytes, bytes], int, int] | None:
        """Header fields, data position and data length of a record; None if there is no record."""
        start = self._read_at(position, 4)
        if len(start) < 4 or (length := _uint32.unpack(start)[0]) > _LONGEST_HEADER:
            return None
        header = self._file.read(length)
        data_length = self._file.read(4)
        if len(data_length) < 4:
            return None
        try:
            fields = _header_fields(header)
        except struct.error:
            return None
        if len(fields.get(b"op", b"")) != 1:
            return None
        return fields, position + 8 + length, _uint32.unpack(data_length)[0]

    def _take_index(self, fields: dict[bytes, bytes], entries: bytes) -> None:
        table = np.frombuffer(entries, dtype="<u4").reshape(-1, _INDEX_ENTRY // 4)
        if len(table):
            times = table[:, 0].astype(np.int64) * 1_000_000_000 + table[:, 1]
            channel = _uint32.unpack(fields[b"conn"])[0]
            self._note(self.chunks[-1], channel, times.tolist())

    def _take_connection(self, fields: dict[bytes, bytes], content: bytes) -> None:
        details = _header_fields(content)
        topic = "/" + "/".join(part for part in fields[b"topic"].decode().split("/") if part)
        message_type = normalize_msgtype(details[b"type"].decode())
        self.channels[_uint32.unpack(fields[b"conn"])[0]] = BagTopic(topic, message_type, "ros1")

    def _learn_channels(self, chunk: Chunk) -> None:
        """Connections are in the chunk of their first message, and again at the end, which may be lost."""
        if not chunk.counts:
            self._count_messages()
        if chunk.counts and all(channel in self.channels for channel in chunk.counts):
            return
        with suppress(*_GARBAGE):
            for fields, content in _records(self._content(chunk, self._allowance)):
                if fields[b"op"] == _CONNECTION_OPERATION:
                    self._take_connection(fields, bytes(content))

    def _count_messages(self) -> None:
        """Read the last chunk; part of it or its index may be cut off or damaged."""
        if not self.chunks:
            return
        last = self.chunks[-1]
        last.counts.clear()
        for time, channel, _ in self._messages_in(self._content(last, self._allowance)):
            self._note(last, channel, [time])
        if not all(channel in self.channels for channel in last.counts):
            self._learn_channels(last)

    def _find_damage(self, end: int) -> Damage | None:
        if self._index_position == 0:
            return Damage(self.path.name, "was never closed by its recorder", end, None)
        if self._file_size < self._index_position:
            return Damage(self.path.name, "is cut off", end, self._index_position)
        if end < self._file_size:
            return Damage(self.path.name, "is damaged", end, self._file_size)
        if len(self.chunks) < self._expected_chunks:
            return Damage(self.path.name, "is cut off", end, self._file_size)
        return None

    def _messages_in(self, content: bytes | bytearray) -> Iterator[tuple[int, int, memoryview]]:
        """Messages up to the first damaged one."""
        with suppress(*_GARBAGE):
            for fields, data in _records(content):
                if fields[b"op"] == _MESSAGE_OPERATION:
                    seconds, nanoseconds = _time.unpack(fields[b"time"])
                    channel = _uint32.unpack(fields[b"conn"])[0]
                    yield seconds * 1_000_000_000 + nanoseconds, channel, data
