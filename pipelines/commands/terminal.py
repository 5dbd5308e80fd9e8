"""What is printed reaches any terminal, and nothing is printed that is not ours."""

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
"""For terminals that do not know them."""


def prepare_terminal() -> None:
    """Call this once, before anything is printed."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by whoever started us
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115, PTH123 (open to the end)
    codecs.register_error("racecar", _in_ascii)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="racecar")
    logging.basicConfig(format=LOG_FORMAT, level=logging.ERROR)
    logging.getLogger("racecar").setLevel(logging.WARNING)
    if not sys.warnoptions and os.environ.get("RACECAR_DEBUG") != "1":
        warnings.simplefilter("ignore")  # what a user should know is said in words


def leave_terminal() -> None:
    """Call this last: what could not be printed, because nobody reads it or the disk is full, is not tried
    again by Python when it ends."""
    try:
        sys.stdout.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def teller(*, quiet: bool, on_stderr: bool = False) -> Callable[[str], None]:
    """Says at once what is being done, unless a command is to be quiet."""

    def tell(sentence: str) -> None:
        if not quiet:
            print(sentence, file=sys.stderr if on_stderr else sys.stdout, flush=True)

    return tell


def one_line(sentence: str) -> str:
    """A sentence without what would break the line or move a terminal's cursor, as in a file's name."""
    words = " ".join(sentence.splitlines())
    return "".join(letter if letter.isprintable() else "?" for letter in words)


def _in_ascii(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    letters = error.object[error.start : error.end]
    return "".join(_IN_ASCII.get(letter, "?") for letter in letters), error.end
