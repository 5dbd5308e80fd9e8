"""By which command a file was written, as it says itself: JSON in its first key, pictures in ``Software``."""

import re
from contextlib import suppress
from pathlib import Path

from PIL import Image

_COMMAND = re.compile(rb'\{\s*"command": "(racecar[^"]*)"')
_FIRST_BYTES = 200
"""Read from a JSON file; the longest name of a command takes fewer."""


def author_of(path: Path) -> str | None:
    """A command such as "racecar map"; None if another program wrote the file, or it cannot be read."""
    with suppress(OSError), path.open("rb") as file:
        found = _COMMAND.match(file.read(_FIRST_BYTES))
        return _author_of_picture(path) if found is None else found[1].decode(errors="replace")
    return None


def _author_of_picture(path: Path) -> str | None:
    try:
        with Image.open(path, formats=["PNG"]) as picture:
            author = picture.info.get("Software")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
    return author if isinstance(author, str) and author.startswith("racecar") else None
