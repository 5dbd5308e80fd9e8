"""Decompression that gives what it can of damaged data, and no more than memory and disk can bear."""

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
"""With which compressed data begin; RFC 8878, 3.1.1. No CDR message begins so."""

LOOSE = "loose"
"""In place of a compression: messages of MCAP that stand outside chunks."""
_UNCOMPRESSED = ("", "none", LOOSE)
"""As MCAP and ROS 1 say it."""
_DECOMPRESSORS: dict[str, Callable[[], Any]] = {
    "bz2": bz2.BZ2Decompressor,
    "lz4": lz4.frame.LZ4FrameDecompressor,
    "zstd": zstd.ZstdDecompressor,
}
_ERRORS = (OSError, EOFError, RuntimeError, ValueError, MemoryError, zstd.ZstdError)
"""What decompressors raise on damaged data."""
_STEP = 4096
"""Bytes decompressed at once, because an error in a later step leaves the earlier ones intact."""
_PIECE = 1 << 20
"""Bytes that one step gives at most, because a few may stand for gigabytes."""
_LARGEST_RATIO = 200
"""Of what comes out of a file to its size, since scans shrink to a half or a tenth, and black images to a
hundredth."""
_ANY_BYTES = 16 << 20
"""Beyond that, since an empty map of 4000 x 4000 cells shrinks to next to nothing."""
_MOST_BLOCK_BYTES = 512 << 20
"""That no block may grow to, so that memory suffices."""


class Allowance:
    """How many bytes may yet come out of a file in one pass over it, whatever the file claims to hold."""

    def __init__(self, file_size: int) -> None:
        self._left = _ANY_BYTES + _LARGEST_RATIO * file_size

    def gives(self, size: int) -> bool:
        """Whether so many bytes may come out; if so, they are taken off."""
        if is_allowed := size <= self._left:
            self._left -= size
        return is_allowed


def decompress_what_is_there(data: bytes, compression: str, allowance: Allowance) -> bytes | bytearray:
    """The content of a compressed block, as far as it is whole and allowed; nothing of a block that is not
    readable."""
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
    """The content of one or several compressed frames; raises one of `_ERRORS` where they are damaged."""
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
    """Unpack a file that is compressed as a whole into a folder; the file there, and whether it is whole.

    Raises UserError where nothing can be unpacked, or where there is no room for it.
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
    """Raises UserError where so many bytes of what is made of a file do not fit into a temporary folder."""
    if shutil.disk_usage(folder).free < size + _PIECE:
        raise UserError(
            f"There is no room in {folder} to unpack {source}: let TMPDIR name a folder on a larger disk."
        )
