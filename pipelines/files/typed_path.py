"""A path as a person types or copies it."""

from pathlib import Path

from racecar.maps.errors import UserError


def typed_path(text: str) -> Path:
    """The path that is meant; quotes around it and ``file://`` before it are left out. Raises UserError when
    there can be no such path."""
    named = text.strip().strip("'\"").removeprefix("file://")
    if not named:
        raise UserError("The path is empty: type one.")
    try:
        path = Path(named).expanduser()
        path.stat()
    except (FileNotFoundError, NotADirectoryError, PermissionError):
        return path  # which is told of where it is used
    except (OSError, RuntimeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise UserError(f"{named[:80]} cannot be a path: {reason.lower().rstrip('.')}.") from error
    return path
