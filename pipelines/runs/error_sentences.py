"""Describe an error in one sentence, and decide whether the user can fix it."""

import errno

from racecar.maps.errors import UserError
from racecar.pipelines.files.optional_packages import OPTIONAL, how_to_install

_NO_ROOM = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS}
_MENDABLE_BY_USER = _NO_ROOM | {
    errno.EACCES,
    errno.EPERM,
    errno.EIO,
    errno.ELOOP,
    errno.EMFILE,
    errno.ENAMETOOLONG,
    errno.ENFILE,
    errno.ENOMEM,
    errno.ESTALE,
}

TO_BE_RECOGNIZED = (
    "if you know where on that map it begins, extend the map by its bag with that as the initial pose "
    "(parameters continued and initial_pose, flags --continue and --initial-pose); else record a drive that "
    "passes some 10 m of where an earlier drive went"
)
"""What helps a drive that is not recognized on an earlier map."""


def is_mendable_by_user(error: BaseException) -> bool:
    """Whether the error is not a bug of this project."""
    if isinstance(error, OSError):
        return error.errno in _MENDABLE_BY_USER
    return isinstance(error, UserError | MemoryError) or _missing_package(error) is not None


def in_one_sentence(error: BaseException) -> str:
    """What is wrong, and how to fix or report it."""
    if isinstance(error, UserError):
        return str(error)
    if (package := _missing_package(error)) is not None:
        return f"This needs a package: {how_to_install(package)}."
    if isinstance(error, MemoryError):
        from racecar.pipelines.files.report import (
            peak_memory_mb,
        )  # loads NumPy, which the command line does without

        return (
            f"There is not enough memory for this ({peak_memory_mb() / 1e3:.1f} GB were in use): close other "
            "programs, take a smaller map or a part of the recording, or a machine with more memory."
        )
    if isinstance(error, OSError) and error.errno in _MENDABLE_BY_USER:
        place = error.filename if isinstance(error.filename, str) else "a file"
        verb = "write" if error.errno in _NO_ROOM else "use"
        return f"Cannot {verb} {place}: {(error.strerror or '').lower()}."
    summary = " ".join(str(error).split()) or "no message"
    return (
        f"This is a fault in racecar, not yours ({type(error).__name__}: {summary}); please run it again "
        "with RACECAR_DEBUG=1 and report what it prints."
    )


def _missing_package(error: BaseException) -> str | None:
    if not isinstance(error, ModuleNotFoundError):
        return None
    package = (error.name or "").partition(".")[0]
    return package if package in OPTIONAL else None
