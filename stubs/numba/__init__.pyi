"""What the kernels use of numba: a compiled function keeps the signature of the Python one."""

from collections.abc import Callable
from typing import Any, TypeVar

_Function = TypeVar("_Function", bound=Callable[..., object])

def njit(
    *, cache: bool = ..., nogil: bool = ..., inline: str = ..., fastmath: set[str] = ...
) -> Callable[[_Function], _Function]: ...

void: Any
