"""Files appear whole or not at all: written beside their place and renamed at the end.

Beside is a folder ``.racecar-…``, which is removed again. That of a run that was killed is removed by a later
one: whoever writes into such a folder holds a lock on it, which the system takes from a process that ends.
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
"""What file systems answer that know no fsync."""


@contextmanager
def write_atomically(path: Path) -> Iterator[Path]:
    """Yield a path of the same name in an empty folder beside `path`, and rename it to `path` on success.

    Missing parent folders are made. On an error nothing is left behind. What links point to is replaced, and
    what is no file, such as a device or a pipe, is written into. Raises UserError when the place cannot be
    written to.
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
    """Yield a new folder in `home`, which is made if missing, and remove it in the end.

    Raises UserError that names `path`, for whose sake it is wanted, when `home` cannot be written to.
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
    """Let a file take the place of another, or flow into what is no file. Raises OSError."""
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
    """Have the disk hold the contents of a file, or the names in a folder, if power fails. Raises OSError."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in _WITHOUT_SYNC:
            raise
    finally:
        os.close(descriptor)


def is_staged(path: Path) -> bool:
    """Whether a path lies in a staging folder, which reaches the disk as a whole when its time comes."""
    return any(part.startswith(_PREFIX) for part in path.parts)


def is_stream(path: Path) -> bool:
    """Whether a path leads to a device, a pipe or a socket, or to this process's own output."""
    try:
        there = path.stat()
    except OSError:
        return False
    is_file = stat.S_ISREG(there.st_mode) or stat.S_ISDIR(there.st_mode)
    return not is_file or _own_output(there) is not None


def cannot_write(path: Path, error: OSError) -> UserError:
    """What to tell when a place cannot be written to."""
    reason = " ".join((error.strerror or str(error)).lower().split()).rstrip(".")
    return UserError(f"Cannot write to {path}: {reason}; choose another place.")


def _staging_place(path: Path) -> Path:
    """A folder on the file system that a file goes to; for what is no file, that of temporary files."""
    return Path(tempfile.gettempdir()) if is_stream(path) else Path(os.path.realpath(path)).parent


def _open_stream(path: Path) -> BinaryIO:
    own = _own_output(path.stat())
    if own is None:
        descriptor = os.open(
            path, os.O_WRONLY | os.O_NONBLOCK
        )  # a pipe that nobody reads is an error at once
        os.set_blocking(descriptor, True)
    else:
        with suppress(ValueError, AttributeError):
            (sys.stdout if own == 1 else sys.stderr).flush()  # what was printed before stands before
        descriptor = os.dup(own)
    return os.fdopen(descriptor, "wb")


def _own_output(there: os.stat_result) -> int | None:
    """The descriptor of this process's output or error output, if that is meant.

    Written to by itself it goes on where it is; a file that it leads to would be replaced under it otherwise.
    """
    for descriptor in (1, 2):
        with suppress(OSError):
            if os.path.samestat(there, os.fstat(descriptor)):
                return descriptor
    return None


def _locked_folder(home: Path) -> tuple[Path, int]:
    """A new folder, and the descriptor that holds its lock."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=home))
        lock = os.open(folder, os.O_RDONLY)
        with suppress(OSError):  # a file system without locks, where nothing that was abandoned is removed
            fcntl.flock(lock, fcntl.LOCK_EX)
        if folder.exists():
            return folder, lock
        os.close(lock)  # another run took it for abandoned before it was locked


def remove_abandoned(home: Path) -> None:
    """Remove the folders of runs that were killed: those that nobody holds the lock of."""
    for folder in home.glob(f"{_PREFIX}*"):
        with suppress(OSError):
            lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(folder, ignore_errors=True)
            finally:
                os.close(lock)
