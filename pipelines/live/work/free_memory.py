"""Return free memory to the system: a node that runs for hours is not alone on its car."""

import ctypes

_C = ctypes.CDLL(None)
_MMAP_THRESHOLD, _ARENA_MAX = -3, -8
"""Numbers of glibc's parameters."""
_LARGE = 128 * 1024
"""Bytes, glibc's initial value."""


def keep_memory_together() -> None:
    """Allocate large blocks in their own pages from now on, which are returned when freed, and small blocks
    of all new threads from one heap; no effect if the C library does not support it.

    glibc takes larger and larger blocks from its heap as such are freed, see mallopt(3). They leave holes
    between blocks in use, and the spare capacity of arrays takes memory before it is written. With a heap per
    thread, others cannot use what one has freed; the threads of a node hardly ever allocate at once, as all
    but one wait for Python.
    """
    _call("mallopt", _MMAP_THRESHOLD, _LARGE)
    _call("mallopt", _ARENA_MAX, 1)


def give_back_free_memory() -> None:
    """Return unused pages to the system; no effect if the C library does not support it.

    By itself glibc returns only the end of its heap, see malloc_trim(3). It takes a few milliseconds.
    """
    _call("malloc_trim", 0)


def _call(name: str, *arguments: int) -> None:
    function = getattr(_C, name, None)
    if function is not None:
        function(*arguments)
