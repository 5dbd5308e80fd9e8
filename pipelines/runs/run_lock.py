"""One run at a time writes to a folder."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from racecar.maps.whole_files import cannot_write


@contextmanager
def run_lock(out: Path) -> Iterator[None]:
    """Wait for the lock of an output folder, and hold it during the block.

    The lock is a file beside the folder, removed at the end; the system releases it when a process dies.
    Raises UserError when the folder cannot be written to.
    """
    path = out.parent / f".{out.name}.lock"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = _locked(path)
    except OSError as error:
        raise cannot_write(out, error) from error
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(lock)


def _locked(path: Path) -> int:
    while True:
        lock = os.open(path, os.O_WRONLY | os.O_CREAT, 0o666)
        with suppress(OSError):  # a file system without locks
            fcntl.flock(lock, fcntl.LOCK_EX)
        if path.exists() and os.path.samestat(os.fstat(lock), path.stat()):
            return lock
        os.close(lock)  # this file was removed by the previous holder of the lock
