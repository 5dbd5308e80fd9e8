"""Text files that a user names."""

import os
from pathlib import Path

from racecar.maps.errors import UserError

MOST_BYTES = 200_000_000
"""Because a trajectory of twelve hours at 40 Hz is no longer, and a device such as /dev/zero has no end."""


def read_text(path: str | Path, most_bytes: int = MOST_BYTES) -> str:
    """The contents of a UTF-8 file, or of a pipe.

    Raises UserError when there is none, when it is not text, and when it is longer than it may be.
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
    """Open a file; a pipe that nobody writes to is empty, where it would be waited for without end."""
    descriptor = os.open(path, flags | os.O_NONBLOCK)
    os.set_blocking(descriptor, True)
    return descriptor
