"""A path as typed or pasted by a user."""

from pathlib import Path

from racecar.maps.errors import UserError


def typed_path(text: str) -> Path:
    """The intended path, without surrounding quotes or a leading ``file://``. Raises UserError when no such
    path can exist."""
    named = text.strip().strip("'\"").removeprefix("file://")
    if not named:
        raise UserError("The path is empty: type one.")
    try:
        path = Path(named).expanduser()
        path.stat()
    except (FileNotFoundError, NotADirectoryError, PermissionError):
        return path  # reported where it is used
    except (OSError, RuntimeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise UserError(f"{named[:80]} cannot be a path: {reason.lower().rstrip('.')}.") from error
    return path
