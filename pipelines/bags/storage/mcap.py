"""MCAP files whose end is missing or whose inside is damaged: https://mcap.dev/spec.

Whole files are read by ``rosbags``; this reader needs no summary at the end of the file.
"""

import struct
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np
from rosbags.typesys.msg import normalize_msgtype

from racecar.pipelines.bags.storage.chunks import BagTopic, Chunk, ChunkedFile, Damage
from racecar.pipelines.bags.storage.compression import decompress_what_is_there

_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _MESSAGE_INDEX, _DATA_END = 0x03, 0x04, 0x05, 0x06, 0x07, 0x0F
_LOOSE = "loose"
"""In place of a compression: messages that stand outside chunks."""
_LOOSE_BYTES = 1 << 20

_record_head = struct.Struct("<BQ")
_message_head = struct.Struct("<HIQQ")
_chunk_head = struct.Struct("<QQQII")
_two_uint16 = struct.Struct("<HH")
_uint32 = struct.Struct("<I")
_uint64 = struct.Struct("<Q")


def _records(data: bytes) -> Iterator[tuple[int, bytes]]:
    """The whole records in a chunk's content: operation and content."""
    position = 0
    while position + 9 <= len(data):
        operation, size = _record_head.unpack_from(data, position)
        position += 9
        if position + size > len(data) or (operation == _MESSAGE and size < _message_head.size):
            return
        yield operation, data[position : position + size]
        position += size


def _string(data: bytes, position: int) -> tuple[str, int]:
    end = position + 4 + _uint32.unpack_from(data, position)[0]
    return data[position + 4 : end].decode(errors="replace"), end


class McapFile(ChunkedFile):
    """An ``.mcap`` file, read from front to back as far as it goes."""

    name = ".mcap"
    magic = b"\x89MCAP0\r\n"
    suffix = ".mcap"
    is_ros2 = True

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._schema_names: dict[int, str] = {}
        end, is_closed = self._scan(len(self.magic))
        if self.chunks:
            self._learn(self.chunks[-1], may_lack_index=True)
        if not is_closed:
            cause = "is cut off" if end == self._file_size else "is damaged"
            self.damage = Damage(path.name, cause, end, None)

    def _scan(self, position: int) -> tuple[int, bool]:
        """Find chunks and channels; returns where the readable part ends, and whether the data ends there."""
        while len(head := self._read_at(position, 9)) == 9:
            operation, size = _record_head.unpack(head)
            begin = position + 9
            if operation == _DATA_END:
                return position, True
            try:
                self._take(operation, begin, size)
            except (struct.error, ValueError):
                return position, False
            if begin + size > self._file_size:
                break
            position = begin + size
        return self._file_size, False

    def _take_chunk(self, begin: int) -> None:
        head = self._read_at(begin, _chunk_head.size)
        if len(head) < _chunk_head.size:
            return
        *_, name_length = _chunk_head.unpack(head)
        name_at = begin + _chunk_head.size
        if name_at + name_length + 8 > self._file_size:
            return
        compression = self._read_at(name_at, name_length).decode(errors="replace")
        size = _uint64.unpack(self._file.read(8))[0]
        content_at = name_at + name_length + 8
        self.chunks.append(Chunk(content_at, min(size, self._file_size - content_at), compression))

    def _take(self, operation: int, begin: int, size: int) -> None:
        if operation == _CHUNK:
            if self.chunks:
                self._learn(self.chunks[-1])
            self._take_chunk(begin)
        elif not 0 < operation < _DATA_END:
            raise ValueError("no such record")
        elif begin + size > self._file_size:
            return
        elif operation == _MESSAGE:
            channel, _, time, _ = _message_head.unpack(self._read_at(begin, _message_head.size))
            self._loose_chunk(begin - 9, size + 9).note(channel, time, time)
        elif operation == _MESSAGE_INDEX and self.chunks and size > 6:
            content = self._read_at(begin, size)
            channel = int.from_bytes(content[:2], "little")
            times = np.frombuffer(content, dtype="<u8", offset=6)[::2]
            self.chunks[-1].note(channel, int(times.min()), int(times.max()), len(times))
        elif operation in (_SCHEMA, _CHANNEL):
            self._take_description(operation, self._read_at(begin, size))

    def _loose_chunk(self, begin: int, size: int) -> Chunk:
        """The chunk that a message outside chunks is counted to."""
        last = self.chunks[-1] if self.chunks else None
        if last is None or last.compression != _LOOSE or last.size > _LOOSE_BYTES:
            last = Chunk(begin, 0, _LOOSE)
            self.chunks.append(last)
        last.size = begin + size - last.begin
        return last

    def _take_description(self, operation: int, content: bytes) -> None:
        if operation == _SCHEMA:
            name, _ = _string(content, 2)
            self._schema_names[int.from_bytes(content[:2], "little")] = name
        elif operation == _CHANNEL:
            channel, schema = _two_uint16.unpack_from(content)
            topic, position = _string(content, 4)
            encoding, _ = _string(content, position)
            message_type = normalize_msgtype(self._schema_names.get(schema, "unknown/msg/Unknown"))
            self.channels[channel] = BagTopic(topic, message_type, encoding)

    def _learn(self, chunk: Chunk, may_lack_index: bool = False) -> None:
        """Look into a chunk that no index describes, or whose channels were not met before."""
        if chunk.compression == _LOOSE:
            return
        is_indexed = bool(chunk.counts) and not may_lack_index
        if is_indexed and all(channel in self.channels for channel in chunk.counts):
            return
        chunk.counts.clear()
        for operation, content in _records(self._content(chunk)):
            if operation == _MESSAGE:
                channel, _, time, _ = _message_head.unpack_from(content)
                chunk.note(channel, time, time)
            else:
                self._take_description(operation, content)

    def _content(self, chunk: Chunk) -> bytes:
        compression = "" if chunk.compression == _LOOSE else chunk.compression
        return decompress_what_is_there(self._read_at(chunk.begin, chunk.size), compression)

    def _load(self, chunk: Chunk, wanted: Collection[int]) -> list[tuple[int, int, bytes]]:
        messages = []
        for operation, content in _records(self._content(chunk)):
            if operation == _MESSAGE:
                channel, _, time, _ = _message_head.unpack_from(content)
                if channel in wanted:
                    messages.append((time, channel, content[_message_head.size :]))
        return messages
