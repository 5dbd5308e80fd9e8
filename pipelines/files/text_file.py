"""Text files that a user names."""

from pathlib import Path

from racecar.maps.errors import UserError


def read_text(path: Path) -> str:
    """The contents of a UTF-8 file. Raises UserError when there is none, or when it is not text."""
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise UserError(f"{path} is not a text file.") from error
    except OSError as error:
        raise UserError(f"Cannot read {path}: {(error.strerror or str(error)).lower()}.") from error
