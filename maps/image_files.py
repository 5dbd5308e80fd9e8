"""Write grey images strip by strip, since the image of a large map is larger than its tiled grid."""

import struct
import zlib
from collections.abc import Iterable
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
"""First bytes of a PNG, by definition (ISO/IEC 15948)."""
BLACK, GREY, WHITE = 0, 205, 254
"""Values that map_saver draws for occupied, unknown and free."""
_GREY, _GREY_WITH_OPACITY = 0, 4
"""Colour types of a PNG, by definition."""


def write_pgm(strips: Iterable[NDArray[np.uint8]], shape: tuple[int, int], file: BinaryIO) -> None:
    """Write a binary PGM of shape (rows, columns) from strips (rows, columns), top first."""
    rows, columns = shape
    file.write(f"P5\n{columns} {rows}\n255\n".encode())
    for strip in strips:
        file.write(np.ascontiguousarray(strip).data)


def write_png(strips: Iterable[NDArray[np.uint8]], shape: tuple[int, int], file: BinaryIO) -> None:
    """Write a PNG likewise; strips (rows, columns, 2) also hold opacity."""
    rows, columns = shape
    file.write(_SIGNATURE)
    compressor = zlib.compressobj()
    for number, strip in enumerate(strips):
        if number == 0:
            kind = _GREY if strip.ndim == 2 else _GREY_WITH_OPACITY
            file.write(_chunk(b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, kind, 0, 0, 0)))
        lines = strip.reshape(len(strip), -1)
        unfiltered = np.pad(lines, ((0, 0), (1, 0)))  # each line begins with its filter type: none
        file.write(_chunk(b"IDAT", compressor.compress(unfiltered.tobytes())))
    file.write(_chunk(b"IDAT", compressor.flush()))
    file.write(_chunk(b"IEND", b""))


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
