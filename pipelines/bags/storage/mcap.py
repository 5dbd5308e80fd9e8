"""MCAP files, intact, truncated, or damaged inside: https://mcap.dev/spec.

The file is scanned from front to back. The summary at its end is needed only to find the next chunk after
damaged bytes.
"""

import struct
from bisect import bisect
from collections.abc import Iterator
from contextlib import suppress
from functools import cached_property
from pathlib import Path

import numpy as np
from rosbags.typesys.msg import normalize_msgtype

from racecar.pipelines.bags.storage.chunks import BagTopic, Chunk, ChunkedFile, Damage
from racecar.pipelines.bags.storage.compression import LOOSE, Allowance

MAGIC = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _MESSAGE_INDEX, _CHUNK_INDEX, _DATA_END = (
    0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x0F
)  # fmt: skip
_FIRST_PRIVATE = 0x80
"""Records from here on are extensions, which are skipped."""
_GARBAGE = (struct.error, ValueError)
"""Errors that parsing damaged bytes raises."""
_LOOSE_BYTES = 1 << 20
_LONGEST_NAME = 64
"""Bytes in the name of a compression, which has three or four; more is garbage."""

_record_head = struct.Struct("<BQ")
_message_head = struct.Struct("<HIQQ")
_chunk_head = struct.Struct("<QQQII")
_two_uint16 = struct.Struct("<HH")
_uint32 = struct.Struct("<I")
_uint64 = struct.Struct("<Q")
_three_uint64 = struct.Struct("<3Q")
_footer = struct.Struct("<BQQQI8s")


def _records(data: bytes | bytearray) -> Iterator[tuple[int, memoryview]]:
    """Complete records in the content of a chunk: operation and content."""
    view, position = memoryview(data), 0
    while position + 9 <= len(data):
        operation, size = _record_head.unpack_from(data, position)
        position += 9
        if operation == 0 or position + size > len(data):
            return
        if operation == _MESSAGE and size < _message_head.size:
            return
        yield operation, view[position : position + size]
        position += size


def _string(data: memoryview, position: int) -> tuple[str, int]:
    end = position + 4 + _uint32.unpack_from(data, position)[0]
    return str(data[position + 4 : end], errors="replace"), end


def _is_operation(operation: int) -> bool:
    return 0 < operation <= _DATA_END or operation >= _FIRST_PRIVATE


class McapFile(ChunkedFile):
    """An ``.mcap`` file, read from front to back as far as possible."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._schema_names: dict[int, str] = {}
        self._skipped = 0
        self._content_sizes: dict[int, int] = {}
        self._looked_into: Chunk | None = None
        self._allowance = Allowance(self._file_size)
        end = self._scan(len(MAGIC))
        self._learn_last(may_lack_index=True)
        self._follow_clock(self._allowance)
        if end is None:
            self.damage = Damage(path.name, "is cut off", self._file_size, None)
        elif end < self._file_size:
            self.damage = Damage(path.name, "is damaged", end, None)
        elif self._skipped:
            self.damage = Damage(path.name, "is damaged", self._file_size - self._skipped, self._file_size)

    def _scan(self, position: int) -> int | None:
        """Find chunks and channels; returns the end of the readable part, None if the file is truncated."""
        while len(head := self._read_at(position, 9)) == 9:
            operation, size = _record_head.unpack(head)
            if operation == _DATA_END:
                self._take_summary()
                return self._file_size
            following = position + 9 + size
            is_whole = following <= self._file_size
            try:
                self._take(operation, position + 9, size)
                is_read = is_whole
            except _GARBAGE:
                is_read = False
            if not is_read:
                self._learn_last(may_lack_index=True)
                resumed = self._next_record(position, following)
                if resumed is None:
                    return position if is_whole else None
                self._skipped += resumed - position
                following = resumed
            position = following
        return None

    def _next_record(self, position: int, following: int) -> int | None:
        """Position to resume at after the damaged record at ``position``; None if unknown."""
        operation, size = _record_head.unpack(self._read_at(following, 9).ljust(9, b"\0"))
        if _is_operation(operation) and following + 9 + size <= self._file_size:
            return following
        begins = self._summarized_chunks
        number = bisect(begins, position)
        return begins[number] if number < len(begins) else None

    def _take_summary(self) -> None:
        """Add the channels from the summary, which repeats those of all chunks, including damaged ones."""
        known = dict(self.channels)
        for operation, content in self._summary():
            with suppress(*_GARBAGE):
                self._take_description(operation, content)
        self.channels |= known

    def _summary(self) -> Iterator[tuple[int, memoryview]]:
        """Records in the summary at the end of the file; none if it is missing."""
        footer = self._read_at(self._file_size - _footer.size, _footer.size)
        if len(footer) == _footer.size and footer.endswith(MAGIC):
            summary_at = _footer.unpack(footer)[2]
            yield from _records(self._read_at(summary_at, self._file_size - summary_at))

    @cached_property
    def _summarized_chunks(self) -> list[int]:
        """Positions of the chunks according to the summary."""
        return sorted(
            _three_uint64.unpack_from(content)[2]
            for operation, content in self._summary()
            if operation == _CHUNK_INDEX and len(content) >= _three_uint64.size
        )

    def _take(self, operation: int, begin: int, size: int) -> None:
        """Add a record, which may be incomplete; raises one of `_GARBAGE` if it is not a record."""
        if not _is_operation(operation):
            raise ValueError("no such record")
        if operation == _CHUNK:
            self._learn_last()
            self._take_chunk(begin, size)
        elif begin + size > self._file_size:
            return
        elif operation == _MESSAGE:
            channel, _, time, _ = _message_head.unpack(self._read_at(begin, _message_head.size))
            self._note(self._loose_chunk(begin - 9, size + 9), channel, [time])
        elif operation == _MESSAGE_INDEX and self.chunks and size > 6:
            if self.chunks[-1] is self._looked_into:
                return
            content = self._read_at(begin, size)
            channel = int.from_bytes(content[:2], "little")
            times, places = np.frombuffer(content, dtype="<u8", offset=6).reshape(-1, 2).T
            self._note(self.chunks[-1], channel, times[np.argsort(places, kind="stable")].tolist())
        elif operation in (_SCHEMA, _CHANNEL):
            self._take_description(operation, memoryview(self._read_at(begin, size)))

    def _take_chunk(self, begin: int, record_size: int) -> None:
        _, _, content_size, _, name_length = _chunk_head.unpack(self._read_at(begin, _chunk_head.size))
        if name_length > _LONGEST_NAME:
            raise ValueError("no compression has so long a name")
        name_at = begin + _chunk_head.size
        compression = self._read_at(name_at, name_length).decode(errors="replace")
        size = _uint64.unpack(self._read_at(name_at + name_length, 8))[0]
        content_at = name_at + name_length + 8
        self._content_sizes[content_at] = content_size
        end = min(content_at + size, begin + record_size, self._file_size)
        self.chunks.append(Chunk(content_at, max(end - content_at, 0), compression))

    def _loose_chunk(self, begin: int, size: int) -> Chunk:
        """The chunk to which a message outside chunks is assigned."""
        last = self.chunks[-1] if self.chunks else None
        if last is None or last.compression != LOOSE or last.size > _LOOSE_BYTES:
            last = Chunk(begin, 0, LOOSE)
            self.chunks.append(last)
        last.size = begin + size - last.begin
        return last

    def _take_description(self, operation: int, content: memoryview) -> None:
        if operation == _SCHEMA:
            name, _ = _string(content, 2)
            self._schema_names[int.from_bytes(content[:2], "little")] = name
        elif operation == _CHANNEL:
            channel, schema = _two_uint16.unpack_from(content)
            topic, position = _string(content, 4)
            encoding, _ = _string(content, position)
            message_type = normalize_msgtype(self._schema_names.get(schema, "unknown/msg/Unknown"))
            self.channels[channel] = BagTopic(topic, message_type, encoding)

    def _learn_last(self, may_lack_index: bool = False) -> None:
        """Read the last chunk if no index describes it or it has unknown channels."""
        if not self.chunks or self.chunks[-1].compression == LOOSE:
            return
        chunk = self.chunks[-1]
        is_indexed = bool(chunk.counts) and not may_lack_index
        is_known = is_indexed and all(channel in self.channels for channel in chunk.counts)
        if is_known or chunk is self._looked_into:
            return
        self._looked_into = chunk
        chunk.counts.clear()
        records = self._content(chunk, self._allowance)
        if len(records) < self._content_sizes[chunk.begin]:
            self._skipped += chunk.size
        for operation, content in _records(records):
            if operation == _MESSAGE:
                channel, _, time, _ = _message_head.unpack_from(content)
                self._note(chunk, channel, [time])
            else:
                with suppress(*_GARBAGE):
                    self._take_description(operation, content)

    def _messages_in(self, content: bytes | bytearray) -> Iterator[tuple[int, int, memoryview]]:
        for operation, record in _records(content):
            if operation == _MESSAGE:
                channel, _, time, _ = _message_head.unpack_from(record)
                yield time, channel, record[_message_head.size :]
