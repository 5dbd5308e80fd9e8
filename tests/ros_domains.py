"""ROS domains for tests that run side by side: what is said in one is not heard in another."""

import itertools
import os

_count = itertools.count()


def next_domain() -> int:
    """Of 1 to 100, whose ports no other connection is given; another one each time.

    Workers of one run have process numbers that differ by little, so that none of their first ten domains
    meet.
    """
    return 1 + (os.getpid() + 37 * next(_count)) % 100
