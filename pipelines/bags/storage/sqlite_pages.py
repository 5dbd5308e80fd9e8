"""ROS 2 sqlite bags read page by page, if SQLite itself refuses them because they are truncated or damaged.

Implements only the part of the format (https://sqlite.org/fileformat2.html) that bags need: leaf pages of
tables, their cells, and overflow pages. Messages on missing pages are lost; the rest is read.
"""

import struct
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path

from racecar.pipelines.bags.storage.chunks import BagTopic, Chunk, ChunkedFile, Damage
from racecar.pipelines.bags.storage.compression import Allowance

_LEAF = 0x0D
_HEADER_SIZE = 100
_PAGES_PER_CHUNK = 256
_PAGE_SIZES = tuple(1 << power for power in range(9, 17))
"""Possible page sizes in bytes."""
_USUAL_PAGE_SIZE = 4096
_MOST_RESERVED = 32
"""Bytes reserved at the end of a page; SQLite's own extensions reserve no more."""

_uint16 = struct.Struct(">H")
_uint32 = struct.Struct(">I")

Value = int | bytes | None


def _varint(data: bytes, position: int) -> tuple[int, int]:
    """A number of 1 to 9 bytes, and the position after it."""
    value = 0
    for _ in range(8):
        byte = data[position]
        position += 1
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, position
    return value << 8 | data[position], position + 1


def _column(code: int, record: bytes, position: int) -> tuple[Value, int]:
    """The value of a column of this serial type, and the position after it; floats are not read."""
    if code >= 12:
        end = position + (code - 12) // 2
        return record[position:end], end
    if code in (8, 9):
        return code - 8, position
    size = (0, 1, 2, 3, 4, 6, 8, 8, 0, 0, 0, 0)[code]
    value = int.from_bytes(record[position : position + size], "big", signed=True)
    return (value if size and code != 7 else None), position + size


def _columns(record: bytes, count: int) -> list[Value]:
    """The first ``count`` columns; fewer if the record has fewer."""
    header_size, position = _varint(record, 0)
    value_at, values = header_size, list[Value]()
    while position < header_size and len(values) < count:
        code, position = _varint(record, position)
        value, value_at = _column(code, record, value_at)
        values.append(value)
    return values


class SqlitePages(ChunkedFile):
    """The tables ``topics`` and ``messages`` of a ``.db3`` file, as far as their pages exist."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        header = self._read_at(0, _HEADER_SIZE).ljust(_HEADER_SIZE, b"\0")
        page_size = _uint16.unpack_from(header, 16)[0]
        page_size = 65536 if page_size == 1 else page_size
        self._page_size = page_size if page_size in _PAGE_SIZES else _USUAL_PAGE_SIZE
        self._usable = self._page_size - (header[20] if header[20] <= _MOST_RESERVED else 0)
        self._page_count = self._file_size // self._page_size
        self._scan(range(1, self._page_count + 1), Allowance(self._file_size))
        expected = _uint32.unpack_from(header, 28)[0] * self._page_size
        cause = "is cut off" if self._file_size < expected else "is damaged"
        self.damage = Damage(path.name, cause, self._file_size, max(expected, self._file_size))

    def _scan(self, pages: range, allowance: Allowance) -> None:
        for begin in range(pages.start, pages.stop, _PAGES_PER_CHUNK):
            chunk = Chunk(begin, min(_PAGES_PER_CHUNK, pages.stop - begin))
            for page, cell in self._cells(chunk):
                with suppress(IndexError, UnicodeDecodeError):  # a page of garbage
                    self._take(page, cell, chunk, allowance)
            if chunk.counts:
                self.chunks.append(chunk)

    def _take(self, page: bytes, cell: int, chunk: Chunk, allowance: Allowance) -> None:
        """Add a cell that looks like a row of ``topics`` or ``messages``."""
        row_id, record, is_whole = self._record(page, cell)
        match _columns(record, 4):
            case [None, int(topic), int(time), *_] if is_whole or self._record(page, cell, allowance)[2]:
                chunk.note(topic, time, time)
            case [None, bytes(name), bytes(message_type), bytes(encoding)] if name.startswith(b"/"):
                self.channels[row_id] = BagTopic(name.decode(), message_type.decode(), encoding.decode())

    def _load(
        self, chunk: Chunk, wanted: Collection[int], allowance: Allowance
    ) -> list[tuple[int, int, bytes]]:
        messages = []
        for page, cell in self._cells(chunk):
            with suppress(IndexError):
                match _columns(self._record(page, cell)[1], 3):
                    case [None, int(topic), int(time)] if topic in wanted:
                        _, record, is_whole = self._record(page, cell, allowance)
                        data = _columns(record, 4)[-1]
                        if is_whole and isinstance(data, bytes):
                            messages.append((time, topic, data))
        return messages

    def _cells(self, chunk: Chunk) -> Iterator[tuple[bytes, int]]:
        """Leaf pages, each with the position of a cell in it."""
        for number in range(chunk.begin, chunk.begin + chunk.size):
            page = self._page(number)
            start = _HEADER_SIZE if number == 1 else 0
            if len(page) < self._page_size or page[start] != _LEAF:
                continue
            count = _uint16.unpack_from(page, start + 3)[0]
            for index in range(min(count, (self._usable - start - 8) // 2)):
                cell = _uint16.unpack_from(page, start + 8 + 2 * index)[0]
                if 8 <= cell < self._usable - 16:
                    yield page, cell

    def _record(self, page: bytes, cell: int, allowance: Allowance | None = None) -> tuple[int, bytes, bool]:
        """Row id and record of a cell, and whether it is complete. Overflow pages are read only with an
        allowance, since any number of cells may claim the same ones."""
        size, position = _varint(page, cell)
        row_id, position = _varint(page, position)
        local = self._bytes_on_page(size)
        record = page[position : position + local]
        if allowance is None:
            return row_id, record, local == size
        if size > self._page_count * self._page_size or not allowance.gives(size):
            return row_id, record, False
        pieces, missing = [record], size - local
        number = _uint32.unpack_from(page, position + local)[0] if position + local + 4 <= len(page) else 0
        while missing > 0 and 0 < number <= self._page_count:
            overflow = self._page(number)
            if len(overflow) < self._page_size:
                break
            pieces.append(overflow[4 : 4 + min(missing, self._usable - 4)])
            missing -= len(pieces[-1])
            number = _uint32.unpack_from(overflow)[0]
        return row_id, b"".join(pieces), missing == 0

    def _bytes_on_page(self, size: int) -> int:
        """Bytes on the leaf page itself of a record of this size."""
        most = self._usable - 35
        if size <= most:
            return size
        least = (self._usable - 12) * 32 // 255 - 23
        local = least + (size - least) % (self._usable - 4)
        return local if local <= most else least

    def _page(self, number: int) -> bytes:
        return self._read_at((number - 1) * self._page_size, self._page_size)
