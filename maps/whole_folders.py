"""A folder holds the files of one run: those of a new one take the place of the old one's all together.

They are written into a folder beside. Once that is renamed to ``.racecar.new``, inside the folder that they
go to, the new run is what that folder holds. Then its namesakes of the old run are removed, and its own files
renamed into their places. What is left to do when the process is killed is done by the next one that reads
the folder or writes into it.
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
"""So that whoever waits for it finds all other files."""
_PENDING = ".racecar.new"
_ATTEMPTS = 10
"""At most so many other runs end up in one folder at the same moment."""
_REMOVED = ".wh."
"""Before the name of a file that the new run removes, as in the layers of container images."""


def remove_with(place: Path) -> None:
    """Let the new run that is being written remove the file that the old one may have in this place."""
    place.with_name(_REMOVED + place.name).touch()


def names_in(new: Path) -> tuple[str, ...]:
    """What is on top of a new run, in order; names of folders end in a slash."""
    there = [path for path in new.iterdir() if not path.name.startswith(_REMOVED)]
    return tuple(sorted(f"{path.name}/" if path.is_dir() else path.name for path in there))


def begin_replacing(folder: Path, new: Path) -> None:
    """Make all that lies in the folder ``new`` the files of ``folder``, which is made if missing.

    Both are on one disk. `finish_replacing` has to follow. Raises UserError when a file cannot go to its
    place or an earlier replacement cannot be finished, and OSError; nothing has changed then.
    """
    for source, target in _moves(new, folder):
        if is_stream(target):
            move_into_place(source, target)
        else:
            _require_room(source, target)
    if not is_staged(folder):
        for below, _, names in os.walk(new):
            for name in (*names, ""):
                sync(Path(below, name))
    folder.mkdir(parents=True, exist_ok=True)
    _make_pending(folder, new)
    sync(folder)


def finish_replacing(folder: Path) -> None:
    """Do what a killed run left to be done in a folder, or in one that this lies in.

    Comes before every look at what is in a folder. Raises UserError when it cannot be done.
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
    """Whether there is one, and, in a folder such as /tmp, into which strangers may write, of this user."""
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
            return  # another process has done it
        moves = _moves(pending, pending.parent)
        if is_locked:  # else another process may be at it, and these be new ones
            for source, target in reversed(moves):
                _place(source, target).unlink(missing_ok=True)
        for source, target in moves:
            _move(source, target)
        for below, _, _ in os.walk(pending, topdown=False):
            Path(below).rmdir()
        sync(pending.parent)
    finally:
        os.close(lock)


def _lock(descriptor: int) -> bool:
    """Wait for the lock of a folder; False on a file system without locks."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    except OSError:
        return False
    return True


def _moves(new: Path, folder: Path) -> list[tuple[Path, Path]]:
    """Each file of a new run and its place."""
    moves = []
    for below, _, names in os.walk(new, topdown=False):
        target = folder / Path(below).relative_to(new)
        for name in sorted(names, key=lambda name: (name == MOVED_LAST, name)):
            moves.append((Path(below, name), target / name.removeprefix(_REMOVED)))
    return moves


def _is_removal(source: Path) -> bool:
    return source.name.startswith(_REMOVED)


def _place(source: Path, target: Path) -> Path:
    """What is replaced: not a link, but what it leads to. What is removed may be a link."""
    return target if _is_removal(source) else Path(os.path.realpath(target))


def _move(source: Path, target: Path) -> None:
    if _is_removal(source):
        target.unlink(missing_ok=True)
        source.unlink(missing_ok=True)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        source.replace(_place(source, target))
    except FileNotFoundError:
        if source.exists():
            raise  # else another process was faster


def _require_room(source: Path, target: Path) -> None:
    """Raises UserError where a file could not be moved."""
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
