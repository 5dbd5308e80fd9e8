"""Replace all files of a run in a folder together.

New files are written into a folder beside it. That folder is renamed to ``.racecar.new`` inside the
destination; from then on the new run counts. Then the old run's files of the same names are removed, and the
new files are renamed into their places. If the process is killed, the next one that reads from or writes to
the folder completes this.
"""

import errno
import fcntl
import os
import stat
from contextlib import suppress
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.whole_files import cannot_write, is_staged, is_stream, move_into_place, sync

MOVED_LAST = "report.json"
"""Moved last, so that whoever waits for it finds all other files."""
_PENDING = ".racecar.new"
_ATTEMPTS = 10
"""Runs that may end in one folder at the same moment, at most."""
_REMOVED = ".wh."
"""Prefix of a file that the new run removes, as in the layers of container images."""


def remove_with(place: Path) -> None:
    """Mark a file of the old run for removal when the new run replaces it."""
    place.with_name(_REMOVED + place.name).touch()


def names_in(new: Path) -> tuple[str, ...]:
    """Sorted top-level names of a new run; names of folders end in a slash."""
    there = [path for path in new.iterdir() if not is_removal(path)]
    return tuple(sorted(f"{path.name}/" if path.is_dir() else path.name for path in there))


def begin_replacing(folder: Path, new: Path) -> None:
    """Commit the files in ``new`` as those of ``folder``, which is created if missing.

    Both must be on one disk. Call `finish_replacing` afterwards. Raises OSError, or UserError when a file
    cannot be put in place or an earlier replacement cannot be completed; nothing has changed then.
    """
    for source, target in moves(new, folder):
        if is_stream(target):
            move_into_place(source, target)
        else:
            _require_movable(source, target)
    if not is_staged(folder):
        for below, _, names in os.walk(new):
            for name in (*names, ""):
                sync(Path(below, name))
    folder.mkdir(parents=True, exist_ok=True)
    _make_pending(folder, new)
    sync(folder)


def finish_replacing(folder: Path) -> None:
    """Complete the replacement that a killed run left in a folder or in one of its parents.

    Call it before every look into a folder. Raises UserError when that is impossible.
    """
    for place in (folder, *folder.absolute().parents):
        pending = place / _PENDING
        if not _is_there(pending):
            continue
        try:
            _finish(pending)
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise UserError(
                f"{place} holds only a part of its new files, and the others cannot be moved there from "
                f"{pending} ({reason}): move them by hand, and remove that folder."
            ) from error


def _make_pending(folder: Path, new: Path) -> None:
    for left in reversed(range(_ATTEMPTS)):
        finish_replacing(folder)
        try:
            new.rename(folder / _PENDING)
        except OSError as error:
            if left == 0 or error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise
        else:
            return


def _is_there(pending: Path) -> bool:
    """Whether a pending replacement exists; in shared folders such as /tmp it must belong to this user."""
    with suppress(OSError):
        if pending.is_dir():
            is_shared = bool(pending.parent.stat().st_mode & stat.S_ISVTX)
            return not is_shared or pending.stat().st_uid == os.geteuid()
    return False


def _finish(pending: Path) -> None:
    try:
        lock = os.open(pending, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except FileNotFoundError:
        return
    try:
        is_locked = _lock(lock)
        if not pending.is_dir() or not os.path.samestat(os.fstat(lock), pending.stat()):
            return  # another process has completed it
        files = moves(pending, pending.parent)
        if is_locked:  # without the lock, another process may be moving, and the targets may be new
            for source, target in reversed(files):
                _place(source, target).unlink(missing_ok=True)
        for source, target in files:
            _move(source, target)
        for below, _, _ in os.walk(pending, topdown=False):
            Path(below).rmdir()
        sync(pending.parent)
    finally:
        os.close(lock)


def _lock(descriptor: int) -> bool:
    """Wait for the lock of a folder; False if the file system has no locks."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    except OSError:
        return False
    return True


def moves(new: Path, folder: Path) -> list[tuple[Path, Path]]:
    """Each file or mark of a removal in a new run, and the path that it replaces or removes."""
    found = []
    for below, _, names in os.walk(new, topdown=False):
        target = folder / Path(below).relative_to(new)
        for name in sorted(names, key=lambda name: (name == MOVED_LAST, name)):
            found.append((Path(below, name), target / name.removeprefix(_REMOVED)))
    return found


def is_removal(source: Path) -> bool:
    """Whether a file of a new run stands for the removal of another."""
    return source.name.startswith(_REMOVED)


def _place(source: Path, target: Path) -> Path:
    """The path to replace: links are followed, except for a file to be removed."""
    return target if is_removal(source) else Path(os.path.realpath(target))


def _move(source: Path, target: Path) -> None:
    if is_removal(source):
        target.unlink(missing_ok=True)
        source.unlink(missing_ok=True)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        source.replace(_place(source, target))
    except FileNotFoundError:
        if source.exists():
            raise  # else another process was faster


def _require_movable(source: Path, target: Path) -> None:
    """Raise UserError where a file cannot be moved to its destination."""
    real = _place(source, target)
    home = next(folder for folder in real.parents if os.path.lexists(folder))
    if real.is_dir():
        raise cannot_write(target, OSError("it is a folder"))
    if not home.is_dir():
        raise cannot_write(target, OSError(f"{home} is a file"))
    if home.stat().st_dev != source.stat().st_dev:
        raise cannot_write(target, OSError("it leads to another disk"))
    if not os.access(home, os.W_OK):
        raise cannot_write(target, PermissionError(errno.EACCES, os.strerror(errno.EACCES)))
