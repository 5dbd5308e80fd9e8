"""Results appear whole or not at all: written beside their place and renamed at the end."""

import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from maps.errors import UserError


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
        raise _cannot_write(path, error) from error
    try:
        yield partial
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def output_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder to write into; on success its files move into `path`, replacing their namesakes.

    Other files in `path` stay. On an error, or Ctrl-C, `path` is as it was. Raises UserError at once when
    `path` cannot be written to, so that no work is done in vain.
    """
    if path.exists() and not path.is_dir():
        raise UserError(f"{path} is a file; name a folder to write to.")
    home = next(folder for folder in [path, *path.absolute().parents] if folder.is_dir())
    try:
        staging = Path(tempfile.mkdtemp(prefix=".racecar-", dir=home))
    except OSError as error:
        raise _cannot_write(path, error) from error
    try:
        yield staging
        _move_files(staging, path)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _move_files(source: Path, destination: Path) -> None:
    try:
        for folder, _, names in os.walk(source):
            target = destination / Path(folder).relative_to(source)
            target.mkdir(parents=True, exist_ok=True)
            for name in names:
                Path(folder, name).replace(target / name)
    except OSError as error:
        raise _cannot_write(destination, error) from error


def _cannot_write(path: Path, error: OSError) -> UserError:
    reason = (error.strerror or str(error)).lower()
    return UserError(f"Cannot write to {path}: {reason}; choose another place.")
