"""Decompression of as much of damaged data as possible, within the limits of memory and disk."""

import bz2
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import lz4.frame  # type: ignore[import-untyped]

from racecar.maps.errors import UserError

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
"""Compressed data begin with this; RFC 8878, 3.1.1. No CDR message does."""

LOOSE = "loose"
"""Replaces a compression, for MCAP messages outside chunks."""
_UNCOMPRESSED = ("", "none", LOOSE)
"""Names for this in MCAP and ROS 1."""
_DECOMPRESSORS: dict[str, Callable[[], Any]] = {
    "bz2": bz2.BZ2Decompressor,
    "lz4": lz4.frame.LZ4FrameDecompressor,
    "zstd": zstd.ZstdDecompressor,
}
_ERRORS = (OSError, EOFError, RuntimeError, ValueError, MemoryError, zstd.ZstdError)
"""Errors that decompressors raise on damaged data."""
_STEP = 4096
"""Bytes decompressed in one step; an error in a later step leaves earlier ones intact."""
_PIECE = 1 << 20
"""Most bytes that one step yields, because a few may expand to gigabytes."""
_LARGEST_RATIO = 200
"""Ratio of decompressed size to file size. Scans shrink to a half or a tenth, and black images to a
hundredth."""
_ANY_BYTES = 16 << 20
"""Additional bytes, since an empty map of 4000 x 4000 cells compresses to almost nothing."""
_MOST_BLOCK_BYTES = 512 << 20
"""Largest block, so memory suffices."""


class Allowance:
    """Bytes that may still be decompressed in one pass over a file, whatever the file claims to contain."""

    def __init__(self, file_size: int) -> None:
        self._left = _ANY_BYTES + _LARGEST_RATIO * file_size

    def gives(self, size: int) -> bool:
        """Whether ``size`` bytes may be decompressed; if so, subtracts them."""
        if is_allowed := size <= self._left:
            self._left -= size
        return is_allowed


def decompress_what_is_there(data: bytes, compression: str, allowance: Allowance) -> bytes | bytearray:
    """The content of a compressed block, as far as it is intact and allowed; empty if the block cannot be
    read."""
    if compression in _UNCOMPRESSED:
        return data
    if compression not in _DECOMPRESSORS:
        return b""
    steps = (data[begin : begin + _STEP] for begin in range(0, len(data), _STEP))
    content = bytearray()
    with suppress(*_ERRORS):
        for piece in _pieces(steps, compression):
            if len(content) + len(piece) > _MOST_BLOCK_BYTES or not allowance.gives(len(piece)):
                break
            content += piece
    return content


def _pieces(steps: Iterable[bytes], compression: str) -> Iterator[bytes]:
    """The content of one or several compressed frames; raises one of `_ERRORS` if they are damaged."""
    decompressor = None
    for step in steps:
        while step or (decompressor is not None and not decompressor.needs_input):
            decompressor = decompressor or _DECOMPRESSORS[compression]()
            yield decompressor.decompress(step, _PIECE)
            step = b""
            if decompressor.eof:
                step, decompressor = decompressor.unused_data or b"", None
    if decompressor is not None:
        raise EOFError("its end is missing")


def unpack(packed: Path, folder: Path) -> tuple[Path, bool]:
    """Unpack a file compressed as a whole into a folder; returns its path there, and whether it is complete.

    Raises UserError when nothing can be unpacked, or there is no room for it.
    """
    unpacked = folder / packed.name.removesuffix(packed.suffix)
    allowance = Allowance(packed.stat().st_size)
    with packed.open("rb") as source, unpacked.open("wb") as target:
        try:
            for piece in _pieces(iter(lambda: source.read(_STEP), b""), "zstd"):
                if not allowance.gives(len(piece)):
                    return unpacked, False
                require_space(folder, len(piece), packed)
                target.write(piece)
        except _ERRORS as error:
            if not target.tell():
                raise UserError(f"{packed} is compressed and damaged: copy it again.") from error
            return unpacked, False
    return unpacked, True


def require_space(folder: Path, size: int, source: Path) -> None:
    """Raises UserError when ``size`` bytes made from a file do not fit into a temporary folder."""
    if shutil.disk_usage(folder).free < size + _PIECE:
        raise UserError(
            f"There is no room in {folder} to unpack {source}: let TMPDIR name a folder on a larger disk."
        )
