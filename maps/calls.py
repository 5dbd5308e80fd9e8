"""Calls that users make, checked by the signature, so that a mistake is one sentence."""

import inspect
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from functools import cached_property, wraps
from types import UnionType
from typing import Any, TypeVar, Union, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike

from racecar.maps.errors import UserError

_Called = TypeVar("_Called", bound=Callable[..., Any])

_ALSO: dict[type, tuple[type, ...]] = {
    float: (float, int, np.floating, np.integer),
    int: (int, np.integer),
    bool: (bool, np.bool_),
}
"""What counts as a number in Python."""


def checked(called: _Called) -> _Called:
    """Decorate a function or class that users call: an argument with a wrong name, or of another type than
    its annotation's, raises UserError.

    Arrays are left to whatever takes them, since lists will do, too.
    """
    if isinstance(called, type):
        called.__init__ = _checked(called.__init__, _Call(called.__init__, called.__name__))  # type: ignore[misc]
        return called
    return _checked(called, _Call(called, called.__qualname__.removesuffix(".__init__")))


def _checked(function: _Called, call: "_Call") -> _Called:
    @wraps(function)
    def check_and_call(*args: Any, **named: Any) -> Any:
        kinds = call.kinds
        for name, value in zip(kinds, args, strict=False):
            if not _is_of(value, kinds[name]):
                raise call.wrong_type(name, value)
        for name, value in named.items():
            if not _is_of(value, kinds.get(name, (object,))):
                raise call.wrong_type(name, value)
        try:
            return function(*args, **named)
        except TypeError as error:
            if error.__traceback__ is not None and error.__traceback__.tb_next is None:
                raise call.wrong_names(args, named) from error  # the function was not entered
            raise

    return check_and_call  # type: ignore[return-value]


class _Call:
    """What a function takes, and sentences about what it was given."""

    def __init__(self, function: Callable[..., Any], name: str) -> None:
        self._function, self._name = function, name

    @cached_property
    def kinds(self) -> dict[str, tuple[type, ...]]:
        """The types of each argument, in their order; ``object`` where any will do."""
        parameters = inspect.signature(self._function).parameters.values()
        return {each.name: _kinds_of(each.annotation) for each in parameters}

    @property
    def _names(self) -> list[str]:
        return [name for name in self.kinds if name != "self"]

    @property
    def _required(self) -> list[str]:
        """The arguments that have no default."""
        parameters = inspect.signature(self._function).parameters.values()
        return [each.name for each in parameters if each.default is each.empty and each.name != "self"]

    @property
    def _form(self) -> str:
        """As it is called."""
        others = ["..."] if len(self._names) > len(self._required) else []
        return f"{self._name}({', '.join([*self._required, *others])})"

    def wrong_type(self, name: str, value: object) -> UserError:
        """An argument is of another type."""
        known = " or ".join(dict.fromkeys(_name_of(kind) for kind in _shown(self.kinds[name])))
        meant = [each for each in self._required if type(value) in self.kinds[each] and each != name]
        article = "an" if type(value).__name__[0] in "aeiouAEIOU" else "a"
        order = f"; {article} {type(value).__name__} is for '{meant[0]}', as in {self._form}" if meant else ""
        return UserError(f"{self._name} takes {known} as '{name}', not {_name_of(type(value))}{order}.")

    def wrong_names(self, args: tuple[object, ...], named: Mapping[str, object]) -> UserError:
        """Arguments are missing, are too many, or have unknown names."""
        unknown = [name for name in named if name not in self.kinds]
        if unknown:
            near = get_close_matches(unknown[0], self._names, n=1)
            remedy = f"did you mean '{near[0]}'?" if near else f"its arguments are {', '.join(self._names)}."
            return UserError(f"{self._name} has no argument '{unknown[0]}'; {remedy}")
        given = len(args) - ("self" in self.kinds)
        positional = [
            each.name
            for each in inspect.signature(self._function).parameters.values()
            if each.kind is not each.KEYWORD_ONLY and each.name != "self"
        ]
        if given > len(positional):
            by_name = [name for name in self._names if name not in positional]
            rest = f", and by name: {', '.join(by_name)}" if by_name else ""
            return UserError(f"{self._name} takes {', '.join(positional) or 'nothing'} in this order{rest}.")
        missing = [name for name in positional[given:] if name not in named]
        return UserError(f"{self._name} lacks '{(missing or ['an argument'])[0]}': call {self._form}.")


def _kinds_of(annotation: Any) -> tuple[type, ...]:
    """The classes in an annotation; ``object`` if it has something else, such as an array."""
    members = get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)
    kinds = [get_origin(member) or member for member in members]
    is_array = np.ndarray in kinds or set(members) >= set(get_args(ArrayLike))
    if is_array or annotation is inspect.Parameter.empty or not all(isinstance(kind, type) for kind in kinds):
        return (object,)
    return tuple(each for kind in kinds for each in _ALSO.get(kind, (kind,)))


def _is_of(value: object, kinds: tuple[type, ...]) -> bool:
    """Whether a value is of one of these types; Python takes true and false for the numbers 1 and 0."""
    if isinstance(value, bool):
        return bool in kinds or object in kinds
    return isinstance(value, kinds)


def _shown(kinds: tuple[type, ...]) -> list[type]:
    """Without the kinds of numbers that NumPy has."""
    return [kind for kind in kinds if kind is not type(None) and kind.__module__ != "numpy"]


def _name_of(kind: type) -> str:
    return "None" if kind is type(None) else kind.__name__
