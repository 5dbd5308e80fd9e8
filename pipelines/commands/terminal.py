"""Print in a form that every terminal supports, and suppress output that is not ours."""

import codecs
import logging
import os
import sys
import warnings
from collections.abc import Callable

LOG_FORMAT = "racecar: %(message)s"
_IN_ASCII = {
    "°": " deg",
    "±": "+-",
    "×": "x",
    "·": "*",
    "→": "->",
    "≤": "<=",
    "≥": ">=",
    "…": "...",
    "–": "-",
    "’": "'",
    "µ": "u",
    "²": "2",
}
"""For terminals that do not support them."""


def prepare_terminal() -> None:
    """Call this once, before anything is printed."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by the parent process
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115, PTH123 (open to the end)
    codecs.register_error("racecar", _in_ascii)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="racecar")
    logging.basicConfig(format=LOG_FORMAT, level=logging.ERROR)
    logging.getLogger("racecar").setLevel(logging.WARNING)
    if not sys.warnoptions and os.environ.get("RACECAR_DEBUG") != "1":
        warnings.simplefilter("ignore")  # the user is informed in plain words instead


def leave_terminal() -> None:
    """Call this last, so that Python does not retry output that failed, because nobody reads it or the disk
    is full, when it exits."""
    try:
        sys.stdout.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def teller(*, quiet: bool, on_stderr: bool = False) -> Callable[[str], None]:
    """Announces each step at once, unless a command is quiet."""

    def tell(sentence: str) -> None:
        if not quiet:
            print(sentence, file=sys.stderr if on_stderr else sys.stdout, flush=True)

    return tell


def one_line(sentence: str) -> str:
    """Remove what would break the line or move a terminal's cursor, such as in a file's name."""
    words = " ".join(sentence.splitlines())
    return "".join(letter if letter.isprintable() else "?" for letter in words)


def _in_ascii(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    letters = error.object[error.start : error.end]
    return "".join(_IN_ASCII.get(letter, "?") for letter in letters), error.end
