"""What makes the address of a page secret: whoever knows it may use the page."""

import os
import re
import secrets
import tempfile
from pathlib import Path

from racecar.pipelines.files.state_folder import state_folder

SECRET_FILE = "page_secret"
"""In the folder of what is kept; a page has another address once it is removed."""
_BYTES = 24
"""So many at random nobody guesses; they make 32 characters."""
_FORM = re.compile(r"[\w-]{32}", re.ASCII)


def page_secret() -> str:
    """The same for all pages of this user, from a file that nobody else may read: so a page that is open in a
    browser finds the next server on its port. Where none can be kept, a new one."""
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
    """The secret, if there is one that nobody else can know."""
    if not path.is_file():
        return None
    with path.open(errors="replace") as file:
        status, secret = os.fstat(file.fileno()), file.read(100)
    is_private = status.st_uid == os.getuid() and not status.st_mode & 0o077
    return secret if is_private and _FORM.fullmatch(secret) else None


def _keep(secret: str, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    number, name = tempfile.mkstemp(dir=path.parent)  # which only this user may read
    with os.fdopen(number, "w") as file:
        file.write(secret)
    Path(name).replace(path)
