"""Sessions and checkpoints as files: NumPy's .npz, without pickles, each with its format and version.

Besides ``format`` (text) and ``version`` (int64) a session holds the arrays that `Session` names. A
checkpoint holds those, the drive's under ``drive.`` as `Drive` names them, what dead reckoning keeps
under ``reckoning.``, what identifies the run, and under ``besides.`` what it keeps itself.
"""

from pathlib import Path
from typing import Literal
from zipfile import BadZipFile

import numpy as np

from racecar.mapping.arrays import Arrays
from racecar.mapping.session.session import Session
from racecar.maps.errors import UserError
from racecar.maps.whole_files import write_atomically

SESSION_FILE = "session.npz"
VERSION = 1

Format = Literal["racecar session", "racecar checkpoint"]


def save_session(session: Session, path: Path) -> None:
    """Write what a later drive needs to carry on the map. Raises UserError when the place cannot be
    written to."""
    save_arrays(session.to_arrays(), path, "racecar session")


def load_session(folder: Path) -> Session:
    """The session that ``racecar map`` left in a folder. Raises UserError when there is none to be read."""
    path = folder / SESSION_FILE
    if not path.is_file():
        raise UserError(
            f"There is no {SESSION_FILE} in {folder}, so no map to carry on; "
            "name a folder that `racecar map` has written."
        )
    arrays = load_arrays(path, "racecar session")
    try:
        return Session.from_arrays(arrays)
    except (KeyError, ValueError, IndexError, TypeError) as error:
        raise _damaged(path) from error


def save_arrays(arrays: Arrays, path: Path, kind: Format) -> None:
    """Write arrays whole or not at all. Raises UserError when the place cannot be written to."""
    marks = {"format": np.array(kind), "version": np.array(VERSION)}
    with write_atomically(path) as partial:
        np.savez(partial, **marks, **arrays)  # type: ignore[arg-type]


def load_arrays(path: Path, kind: Format) -> Arrays:
    """The arrays of a file. Raises UserError when it is damaged, of another kind or of another version."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays: Arrays = {name: file[name] for name in file.files}
        is_kind, version = str(arrays.pop("format")) == kind, int(arrays.pop("version"))
    except (OSError, ValueError, KeyError, TypeError, EOFError, AttributeError, BadZipFile) as error:
        raise _damaged(path) from error
    if not is_kind:
        raise UserError(f"{path} is not a {kind}; name one that `racecar map` has written.")
    if version != VERSION:
        raise UserError(
            f"{path} has version {version} of its format, this racecar knows version {VERSION}; "
            "build the map again, or use the racecar that wrote it."
        )
    return arrays


def _damaged(path: Path) -> UserError:
    return UserError(f"{path} is damaged or no file of racecar's; build the map again.")
