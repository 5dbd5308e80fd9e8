"""What benchmarks compare: a method as it is, with something off, or with what it is fed made worse."""

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
"""A class or module, the name of something that it defines, and what that is replaced by."""
Fault: TypeAlias = Callable[[list[Measurement]], list[Measurement]]
"""Of the messages of a drive, as a faulty car would give them."""


@dataclass(frozen=True, eq=False)
class Variant:
    """What is changed."""

    settings: Mapping[str, Any] = field(default_factory=dict)
    replacements: tuple[Replacement, ...] = ()
    """Of what is no setting."""
    faults: tuple[Fault, ...] = ()
    """One after the other."""

    def configured(self, settings: _S) -> _S:
        """The settings with the changes."""
        return type(settings).model_validate({**settings.model_dump(), **self.settings})

    def in_place(self) -> AbstractContextManager[None]:
        """What is no setting is replaced within the block, in this process."""
        return replaced(self.replacements)

    def spoiled(self, messages: list[Measurement]) -> list[Measurement]:
        """The messages of a drive, with all faults."""
        for fault in self.faults:
            messages = fault(messages)
        return messages

    def __or__(self, other: "Variant") -> "Variant":
        """Both together."""
        return Variant(
            {**self.settings, **other.settings},
            self.replacements + other.replacements,
            self.faults + other.faults,
        )


def replacing(owner: object, **by: object) -> Variant:
    """With parts of a class or module replaced, by their names."""
    return Variant(replacements=tuple((owner, name, new) for name, new in by.items()))


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


LOOPS_NOT_SEEN_THROUGH = replacing(submap_matching, see_through=lambda *_: SeeThrough(1, 0, 0))
"""The mapper accepts loops of which one scan looks through what the other saw."""
LOOPS_NOT_SUPPORTED = replacing(loop_closure, is_supported=lambda *_: True)
"""The mapper accepts loops that no neighbours confirm."""
