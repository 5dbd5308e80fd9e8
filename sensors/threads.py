"""Number of threads for a parallel loop."""

import os


def thread_count(most: int) -> int:
    """At most ``most``, and no more than OMP_NUM_THREADS, as in other libraries.

    Runs that share a machine use it to divide the cores.
    """
    allowed = os.environ.get("OMP_NUM_THREADS", "")
    return min(most, int(allowed)) if allowed.isdecimal() and int(allowed) > 0 else most
