"""The write-ahead log that SQLite keeps beside a database while it is written to.

A bag that was copied while it was recorded, or whose recorder was killed, has its newest messages there.
SQLite itself reads the log only where it may write beside it. The format:
https://sqlite.org/fileformat2.html#walformat
"""

import struct
from pathlib import Path

PAGE_SIZES = tuple(1 << power for power in range(9, 17))
"""Bytes that a page of a database may have."""
_MAGIC = (0x377F0682, 0x377F0683)
_HEADER_SIZE, _FRAME_HEADER_SIZE = 32, 24

_header = struct.Struct(">8I")
_frame_header = struct.Struct(">6I")


class WriteAheadLog:
    """Pages that were written to the log, and not yet into the database."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb")
        self.page_size = 0
        self.page_count = 0
        """Of the database once the log is written into it; 0 where the log holds nothing valid."""
        self._places: dict[int, int] = {}
        self._scan(path.stat().st_size)

    def __contains__(self, number: int) -> bool:
        return number in self._places

    def __len__(self) -> int:
        return len(self._places)

    @property
    def last_page(self) -> int:
        """The highest number of a page in the log."""
        return max(self._places, default=0)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def page(self, number: int) -> bytes:
        """The newest version of a page that is in the log."""
        self._file.seek(self._places[number])
        return self._file.read(self.page_size)

    def _scan(self, size: int) -> None:
        """Find the pages of whole transactions; those of an earlier use of the log bear another salt."""
        header = self._file.read(_HEADER_SIZE)
        if len(header) < _HEADER_SIZE:
            return
        magic, _, self.page_size, _, *salt, _, _ = _header.unpack(header)
        if magic not in _MAGIC or self.page_size not in PAGE_SIZES:
            return
        written: dict[int, int] = {}
        step = _FRAME_HEADER_SIZE + self.page_size
        for position in range(_HEADER_SIZE, size - step + 1, step):
            self._file.seek(position)
            frame_header = self._file.read(_FRAME_HEADER_SIZE)
            number, page_count, *frame_salt, _, _ = _frame_header.unpack(frame_header)
            if frame_salt != salt:
                return
            written[number] = position + _FRAME_HEADER_SIZE
            if page_count:  # the last frame of a transaction
                self._places |= written
                self.page_count = page_count
                written = {}


def log_beside(path: Path) -> WriteAheadLog | None:
    """The log of a database, where there is one that holds anything."""
    log_path = path.with_name(path.name + "-wal")
    if not log_path.is_file():
        return None
    log = WriteAheadLog(log_path)
    if log.page_count:
        return log
    log.close()
    return None
