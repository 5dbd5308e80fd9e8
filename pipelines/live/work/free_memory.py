"""Memory that is free goes back to the machine: a node that runs for hours is not alone on its car."""

import ctypes

_C = ctypes.CDLL(None)
_MMAP_THRESHOLD, _ARENA_MAX = -3, -8
"""Numbers of glibc's parameters."""
_LARGE = 128 * 1024
"""Bytes, as glibc begins with."""


def keep_memory_together() -> None:
    """Give each large block of memory from now on pages of its own, which leave with it, and let all threads
    that are still to come take the small ones from one heap; nothing happens where the C library cannot do
    it.

    glibc takes larger and larger blocks from its heap as such are freed, see mallopt(3). Among what is in use
    there they leave holes, and the room that arrays have to spare takes memory before anything is written.
    With a heap for each thread, what one has freed is of no use to the others; the threads of a node hardly
    ever allocate at once, as all but one wait for Python.
    """
    _call("mallopt", _MMAP_THRESHOLD, _LARGE)
    _call("mallopt", _ARENA_MAX, 1)


def give_back_free_memory() -> None:
    """Return the pages that hold nothing any more; nothing happens where the C library cannot do it.

    glibc returns by itself only what lies at the end of its heap, see malloc_trim(3). It takes a few
    milliseconds.
    """
    _call("malloc_trim", 0)


def _call(name: str, *arguments: int) -> None:
    function = getattr(_C, name, None)
    if function is not None:
        function(*arguments)
