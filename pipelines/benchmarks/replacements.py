"""What a benchmark puts in place of a constant or a function, to measure what that is good for."""

from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TypeAlias
from unittest.mock import patch

Replacement: TypeAlias = tuple[object, str, object]
"""A class or module, the name of something in it, and what that is replaced by."""


@contextmanager
def replaced(replacements: Iterable[Replacement]) -> Iterator[None]:
    """All are in place within the block, in this process."""
    with ExitStack() as stack:
        for owner, name, by in replacements:
            stack.enter_context(patch.object(owner, name, by))
        yield


def nothing(*_: object, **__: object) -> None:
    """In place of a method that learns or changes something."""
