"""Files appear whole or not at all: written beside their place and renamed at the end."""

import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from racecar.maps.errors import UserError


@contextmanager
def write_atomically(path: Path) -> Iterator[Path]:
    """Yield a path beside `path`, of the same suffix, and rename it to `path` on success.

    Missing parent folders are made. On an error nothing is left behind. Raises UserError when the place
    cannot be written to.
    """
    if path.is_dir():
        raise UserError(f"{path} is a folder; name a file to write to.")
    partial = path.with_name(f".{path.stem}.{secrets.token_hex(4)}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.touch()
    except OSError as error:
        raise cannot_write(path, error) from error
    try:
        yield partial
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def cannot_write(path: Path, error: OSError) -> UserError:
    """What to tell when a place cannot be written to."""
    reason = (error.strerror or str(error)).lower()
    return UserError(f"Cannot write to {path}: {reason}; choose another place.")
