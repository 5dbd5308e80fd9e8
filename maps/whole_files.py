"""Atomic writes: files are written beside their destination and renamed at the end.

Temporary files live in a folder ``.racecar-…``, which is removed afterwards. Folders of killed runs are
removed by later ones: a writer holds a lock on its folder, and the system releases it when the process ends.
"""

import errno
import fcntl
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from racecar.maps.errors import UserError

_PREFIX = ".racecar-"
_WITHOUT_SYNC = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP)
"""Errors from file systems without fsync."""


@contextmanager
def write_atomically(path: Path) -> Iterator[Path]:
    """Yield a path of the same name in an empty folder beside `path`, and rename it to `path` on success.

    Missing parent folders are created. Nothing is left behind on an error. Links are followed; devices and
    pipes are written into. Raises UserError when the destination is not writable.
    """
    if path.is_dir():
        raise UserError(f"{path} is a folder; name a file to write to.")
    with staging_folder(_staging_place(path), path) as folder:
        partial = folder / path.name
        try:
            yield partial
            move_into_place(partial, path)
        except BrokenPipeError:
            raise
        except OSError as error:
            raise cannot_write(path, error) from error


@contextmanager
def staging_folder(home: Path, path: Path) -> Iterator[Path]:
    """Yield a new folder in `home`, created if missing, and remove it at the end.

    Raises UserError naming `path`, which will be written through it, when `home` is not writable.
    """
    try:
        home.mkdir(parents=True, exist_ok=True)
        remove_abandoned(home)
        folder, lock = _locked_folder(home)
    except OSError as error:
        raise cannot_write(path, error) from error
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


def move_into_place(source: Path, destination: Path) -> None:
    """Replace a file by another, or copy into a device or pipe. Raises OSError."""
    if is_stream(destination):
        with source.open("rb") as contents, _open_stream(destination) as stream:
            shutil.copyfileobj(contents, stream)
        source.unlink()
        return
    place = Path(os.path.realpath(destination))
    if is_staged(place):
        source.replace(place)
        return
    sync(source)
    source.replace(place)
    sync(place.parent)


def sync(path: Path) -> None:
    """Flush a file's contents or a folder's entries to disk. Raises OSError."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in _WITHOUT_SYNC:
            raise
    finally:
        os.close(descriptor)


def is_staged(path: Path) -> bool:
    """Whether a path lies in a staging folder, which is flushed to disk as a whole later."""
    return any(part.startswith(_PREFIX) for part in path.parts)


def is_stream(path: Path) -> bool:
    """Whether a path leads to a device, a pipe, a socket or this process's own output."""
    try:
        there = path.stat()
    except OSError:
        return False
    is_file = stat.S_ISREG(there.st_mode) or stat.S_ISDIR(there.st_mode)
    return not is_file or _own_output(there) is not None


def cannot_write(path: Path, error: OSError) -> UserError:
    """The error for a place that cannot be written to."""
    reason = " ".join((error.strerror or str(error)).lower().split()).rstrip(".")
    return UserError(f"Cannot write to {path}: {reason}; choose another place.")


def _staging_place(path: Path) -> Path:
    """A folder on the destination's file system; for streams, the folder of temporary files."""
    return Path(tempfile.gettempdir()) if is_stream(path) else Path(os.path.realpath(path)).parent


def _open_stream(path: Path) -> BinaryIO:
    own = _own_output(path.stat())
    if own is None:
        descriptor = os.open(
            path, os.O_WRONLY | os.O_NONBLOCK
        )  # opening a pipe without a reader fails at once
        os.set_blocking(descriptor, True)
    else:
        with suppress(ValueError, AttributeError):
            (sys.stdout if own == 1 else sys.stderr).flush()  # keeps the order of what was printed before
        descriptor = os.dup(own)
    return os.fdopen(descriptor, "wb")


def _own_output(there: os.stat_result) -> int | None:
    """File descriptor of this process's stdout or stderr if ``there`` is one of them.

    Writing to the descriptor continues at its position; replacing the file behind it would cut it off.
    """
    for descriptor in (1, 2):
        with suppress(OSError):
            if os.path.samestat(there, os.fstat(descriptor)):
                return descriptor
    return None


def _locked_folder(home: Path) -> tuple[Path, int]:
    """A new folder and the descriptor that holds its lock."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=home))
        lock = os.open(folder, os.O_RDONLY)
        with suppress(OSError):  # without file locks, abandoned folders are never removed
            fcntl.flock(lock, fcntl.LOCK_EX)
        if folder.exists():
            return folder, lock
        os.close(lock)  # another run removed it as abandoned before it was locked


def remove_abandoned(home: Path) -> None:
    """Remove the folders of killed runs: those that no process has locked."""
    for folder in home.glob(f"{_PREFIX}*"):
        with suppress(OSError):
            lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(folder, ignore_errors=True)
            finally:
                os.close(lock)
