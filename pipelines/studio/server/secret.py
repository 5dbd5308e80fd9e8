"""The secret in the address of a page: anyone who knows it may use the page."""

import os
import re
import secrets
import tempfile
from pathlib import Path

from racecar.pipelines.files.state_folder import state_folder

SECRET_FILE = "page_secret"
"""File in the state folder; removing it changes the page's address."""
_BYTES = 24
"""Number of random bytes, too many to guess; they make 32 characters."""
_FORM = re.compile(r"[\w-]{32}", re.ASCII)


def page_secret() -> str:
    """The same secret for all pages of this user, from a file that only the user can read, so that an open
    page finds the next server on its port. A new secret if none can be stored."""
    new = secrets.token_urlsafe(_BYTES)
    try:
        path = state_folder() / SECRET_FILE
        secret = _kept(path)
        if secret is None:
            _keep(new, path)
    except (OSError, RuntimeError):
        return new
    return secret or new


def _kept(path: Path) -> str | None:
    """The stored secret, if nobody else can know it."""
    if not path.is_file():
        return None
    with path.open(errors="replace") as file:
        status, secret = os.fstat(file.fileno()), file.read(100)
    is_private = status.st_uid == os.getuid() and not status.st_mode & 0o077
    return secret if is_private and _FORM.fullmatch(secret) else None


def _keep(secret: str, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    number, name = tempfile.mkstemp(dir=path.parent)  # readable only by this user
    with os.fdopen(number, "w") as file:
        file.write(secret)
    Path(name).replace(path)
