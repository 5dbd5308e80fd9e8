"""Memory that is free goes back to the machine: a node that runs for hours is not alone on its car."""

import ctypes


def give_back_free_memory() -> None:
    """Return the pages that hold nothing any more; nothing happens where the C library cannot do it.

    glibc returns by itself only what lies at the end of its heap, see malloc_trim(3). It takes a few
    milliseconds.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
