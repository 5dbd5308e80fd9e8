"""Session files: NumPy's .npz, without pickles, each with its format and version.

Besides ``format`` (text) and ``version`` (int64) they contain the arrays of `Session`.
"""

import math
from pathlib import Path
from typing import IO
from zipfile import ZipFile

import numpy as np

from racecar.mapping.session.session import Session
from racecar.mapping.session.session_layout import checked_session
from racecar.maps.errors import UserError
from racecar.maps.whole_files import write_atomically
from racecar.maps.whole_folders import finish_replacing
from racecar.sensors.arrays import Arrays

SESSION_FILE = "session.npz"
VERSION = 3
_FORMAT = "racecar session"


def save_session(session: Session, path: Path) -> None:
    """Write what a later drive needs to extend the map. Raises UserError when the file cannot be written."""
    save_arrays(session.to_arrays(), path)


def load_session(folder: Path) -> Session:
    """The session that ``racecar map`` wrote to a folder. Raises UserError when it cannot be read."""
    finish_replacing(folder)
    if not (folder / SESSION_FILE).is_file():
        raise UserError(
            f"There is no {SESSION_FILE} in {folder}, so there is no map to extend or to render; name a "
            "folder that `racecar map` has written."
        )
    return Session.from_arrays(load_session_arrays(folder))


def load_session_arrays(folder: Path) -> Arrays:
    """The arrays of the session in a folder, checked. Raises UserError when they are not of a session."""
    path = folder / SESSION_FILE
    arrays = load_arrays(path)
    try:
        return checked_session(arrays)
    except ValueError as error:
        raise _damaged(path) from error


def save_arrays(arrays: Arrays, path: Path) -> None:
    """Write arrays, complete or not at all. Raises UserError when the file cannot be written."""
    marks = {"format": np.array(_FORMAT), "version": np.array(VERSION)}
    with write_atomically(path) as partial:
        np.savez(partial, **marks, **arrays)  # type: ignore[arg-type]


def load_arrays(path: Path) -> Arrays:
    """Arrays from a file. Raises UserError when it is damaged, or has another kind or version."""
    try:
        arrays = _read_arrays(path)
        is_session, version = str(arrays.pop("format")) == _FORMAT, int(arrays.pop("version"))
    except MemoryError:
        raise
    except Exception as error:  # NumPy and zipfile raise all kinds of errors.
        raise _damaged(path) from error
    if not is_session:
        raise UserError(f"{path} is not a {_FORMAT}; name one that `racecar map` has written.")
    if version != VERSION:
        raise UserError(
            f"{path} has version {version} of its format, this racecar knows version {VERSION}; "
            "build the map again, or use the racecar that wrote it."
        )
    return arrays


def _read_arrays(path: Path) -> Arrays:
    """Arrays of an .npz. Raises any error, before allocating memory for what is not in the file.

    An array's header may claim any size, and a compressed member may expand to any size. `save_arrays` does
    not compress, so together they are no larger than the file.
    """
    arrays: Arrays = {}
    with path.open("rb") as file, ZipFile(file) as archive:
        members = archive.infolist()
        if sum(member.file_size for member in members) > path.stat().st_size:
            raise ValueError("its members are larger than the file")
        for member in members:
            with archive.open(member) as stream:
                _check_header(stream, member.file_size)
            with archive.open(member) as stream:
                array = np.lib.format.read_array(stream, allow_pickle=False)
                if stream.read(1):
                    raise ValueError(f"{member.filename} is longer than its array")
            arrays[member.filename.removesuffix(".npy")] = array
    return arrays


def _check_header(stream: IO[bytes], size: int) -> None:
    """Raises ValueError when an array does not match its header; ``size`` is that of both in bytes."""
    version = np.lib.format.read_magic(stream)
    if version == (1, 0):
        shape, _, dtype = np.lib.format.read_array_header_1_0(stream)
    else:
        shape, _, dtype = np.lib.format.read_array_header_2_0(stream)
    is_plain = dtype.kind in "biufU" and dtype.itemsize > 0
    if not is_plain or stream.tell() + math.prod(shape) * dtype.itemsize != size:
        raise ValueError("not as large as its header says")


def _damaged(path: Path) -> UserError:
    return UserError(f"{path} is damaged or not a file of racecar; build the map again.")
