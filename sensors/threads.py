"""How many threads a loop may use."""

import os


def thread_count(most: int) -> int:
    """At most so many, and no more than OMP_NUM_THREADS says, as for other libraries.

    Where several runs share a machine it gives each of them a share of the cores.
    """
    allowed = os.environ.get("OMP_NUM_THREADS", "")
    return min(most, int(allowed)) if allowed.isdecimal() and int(allowed) > 0 else most
