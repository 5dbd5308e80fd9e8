"""Many poses at once in two threads: the kernels that treat them release the GIL."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

_Row = TypeVar("_Row", bound=np.generic)
_Result = TypeVar("_Result", bound=np.generic)


def in_two_threads(
    work: Callable[[NDArray[_Row]], NDArray[_Result]], rows: NDArray[_Row]
) -> NDArray[_Result]:
    """What ``work``, which treats each by itself, makes of rows (N, ...)."""
    with ThreadPoolExecutor(2) as pool:
        return np.concatenate(list(pool.map(work, np.array_split(rows, 2))))
