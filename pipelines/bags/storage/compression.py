"""Decompression that gives what it can of a block whose end is missing."""

import bz2
import sys
from collections.abc import Callable

import lz4.frame  # type: ignore[import-untyped]

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

_DECOMPRESSORS: dict[str, Callable[[], object]] = {
    "bz2": bz2.BZ2Decompressor,
    "lz4": lz4.frame.LZ4FrameDecompressor,
    "zstd": zstd.ZstdDecompressor,
}


def decompress_what_is_there(data: bytes, compression: str) -> bytes:
    """The content of a compressed block, as far as it is whole; nothing of a block that is not readable."""
    if compression in ("", "none"):
        return data
    if compression not in _DECOMPRESSORS:
        return b""
    decompressor = _DECOMPRESSORS[compression]()
    pieces = []
    # In small steps, because an error in a later step leaves the earlier ones intact.
    for begin in range(0, len(data), 4096):
        try:
            pieces.append(decompressor.decompress(data[begin : begin + 4096]))  # type: ignore[attr-defined]
        except (OSError, EOFError, RuntimeError, zstd.ZstdError):
            break
    return b"".join(pieces)
