"""What a benchmark puts in place of a constant or a function, to measure what that is good for."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TypeAlias

from racecar.mapping.loops import loop_closure, submap_matching
from racecar.sensors.matching.see_through import SeeThrough

Replacement: TypeAlias = tuple[Any, str, object]
"""A class or module, the name of something that it defines, and what that is replaced by."""


@contextmanager
def replaced(replacements: Iterable[Replacement]) -> Iterator[None]:
    """All are in place within the block, in this process."""
    before: list[Replacement] = []
    try:
        for owner, name, by in replacements:
            before.append((owner, name, vars(owner)[name]))
            setattr(owner, name, by)
        yield
    finally:
        for owner, name, as_it_was in reversed(before):
            setattr(owner, name, as_it_was)


def nothing(*_: object, **__: object) -> None:
    """In place of a method that learns or changes something."""


LOOPS_NOT_SEEN_THROUGH: Replacement = (submap_matching, "see_through", lambda *_: SeeThrough(1, 0, 0))
"""The mapper accepts loops of which one scan looks through what the other saw."""
LOOPS_NOT_SUPPORTED: Replacement = (loop_closure, "is_supported", lambda *_: True)
"""The mapper accepts loops that no neighbours confirm."""
