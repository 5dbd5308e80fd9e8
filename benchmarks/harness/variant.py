"""What benchmarks compare: a method as it is, with something off, or with degraded input."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import Any, TypeAlias, TypeVar

from racecar.mapping.loops import loop_closure, submap_matching
from racecar.maps.settings import Settings
from racecar.sensors.matching.see_through import SeeThrough
from racecar.sensors.measurement import Measurement

_S = TypeVar("_S", bound=Settings)

Replacement: TypeAlias = tuple[Any, str, object]
"""A class or module, the name of one of its attributes, and the replacement."""
Fault: TypeAlias = Callable[[list[Measurement]], list[Measurement]]
"""Turns the messages of a drive into those of a faulty car."""


@dataclass(frozen=True, eq=False)
class Variant:
    """The changes."""

    settings: Mapping[str, Any] = field(default_factory=dict)
    replacements: tuple[Replacement, ...] = ()
    """For anything that is not a setting."""
    faults: tuple[Fault, ...] = ()
    """Applied one after the other."""

    def configured(self, settings: _S) -> _S:
        """The settings with the changes applied."""
        return type(settings).model_validate({**settings.model_dump(), **self.settings})

    def in_place(self) -> AbstractContextManager[None]:
        """Applies the replacements within the block, in this process."""
        return replaced(self.replacements)

    def spoiled(self, messages: list[Measurement]) -> list[Measurement]:
        """The messages of a drive with all faults applied."""
        for fault in self.faults:
            messages = fault(messages)
        return messages

    def __or__(self, other: "Variant") -> "Variant":
        """Both variants together."""
        return Variant(
            {**self.settings, **other.settings},
            self.replacements + other.replacements,
            self.faults + other.faults,
        )


def replacing(owner: object, **by: object) -> Variant:
    """Replaces attributes of a class or module by name."""
    return Variant(replacements=tuple((owner, name, new) for name, new in by.items()))


@contextmanager
def replaced(replacements: Iterable[Replacement]) -> Iterator[None]:
    """Applies all replacements within the block, in this process."""
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
    """Replaces a method that learns or changes something."""


LOOPS_NOT_SEEN_THROUGH = replacing(submap_matching, see_through=lambda *_: SeeThrough(1, 0, 0))
"""The mapper accepts loops in which one scan sees through what the other saw."""
LOOPS_NOT_SUPPORTED = replacing(loop_closure, is_supported=lambda *_: True)
"""The mapper accepts loops that no neighbours confirm."""
