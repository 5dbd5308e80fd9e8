"""Read text files named by a user."""

import os
from pathlib import Path

from racecar.maps.errors import UserError

MOST_BYTES = 200_000_000
"""Size limit, because twelve hours of trajectory at 40 Hz are less and /dev/zero has no end."""


def read_text(path: str | Path, most_bytes: int = MOST_BYTES) -> str:
    """Contents of a UTF-8 file or a pipe.

    Raises UserError when it is missing, not text, or longer than ``most_bytes``.
    """
    try:
        with open(path, "rb", opener=_open_at_once) as file:
            contents = file.read(most_bytes + 1)
    except OSError as error:
        raise UserError(f"Cannot read {path}: {(error.strerror or str(error)).lower()}.") from error
    if len(contents) > most_bytes:
        raise UserError(
            f"{path} is longer than the {most_bytes / 1e6:g} MB that such a text file may have; "
            "name the right one."
        )
    try:
        text = contents.decode("utf-8")
    except UnicodeDecodeError as error:
        raise UserError(f"{path} is not a text file.") from error
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _open_at_once(path: str, flags: int) -> int:
    """Open a file without blocking: a pipe without a writer is empty instead of being waited for forever."""
    descriptor = os.open(path, flags | os.O_NONBLOCK)
    os.set_blocking(descriptor, True)
    return descriptor
