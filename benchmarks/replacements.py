"""What a benchmark puts in place of a constant or a function, to measure what that is good for."""

from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TypeAlias
from unittest.mock import patch

from racecar.mapping.loops import loop_closure, submap_matching
from racecar.mapping.matching.see_through import SeeThrough

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


LOOPS_NOT_SEEN_THROUGH: Replacement = (submap_matching, "see_through", lambda *_: SeeThrough(1, 0, 0))
"""The mapper accepts loops of which one scan looks through what the other saw."""
LOOPS_NOT_SUPPORTED: Replacement = (loop_closure, "is_supported", lambda *_: True)
"""The mapper accepts loops that no neighbours confirm."""
