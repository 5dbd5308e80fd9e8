"""Whether two paths hold the same bag, wherever it was moved or copied to."""

import hashlib
from pathlib import Path

from racecar.pipelines.bags.storage.folder import read_folder

_PIECE = 1 << 20
"""Bytes that are read at either end of a file, so that a large bag costs no more than a small one; the stamps
in them differ between any two drives, and the sizes count too."""


def bag_fingerprint(bag: Path) -> str:
    """A digest of the sizes of a bag's files and of both ends of each. Raises UserError when it is no bag."""
    digest = hashlib.sha256()
    for path in read_folder(bag).files if bag.is_dir() else [bag]:
        size = path.stat().st_size
        digest.update(size.to_bytes(8, "big"))
        with path.open("rb") as file:
            digest.update(file.read(_PIECE))
            file.seek(max(size - _PIECE, 0))
            digest.update(file.read(_PIECE))
    return digest.hexdigest()
