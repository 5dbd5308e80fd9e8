"""Memory that is free leaves the process, also what lies between blocks that are in use.

Each measurement is made in a process of its own, as what is left of earlier work in the heap would take part.
"""

import platform
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(
    platform.libc_ver()[0] != "glibc", reason="only glibc gives memory back when told to"
)

FREE_BETWEEN_BLOCKS = """
import numpy as np

from racecar.pipelines.files.report import resident_memory_mb
from racecar.pipelines.live.work.free_memory import give_back_free_memory

blocks = [np.ones(8000) for _ in range(2000)]  # of 64 kB, which glibc takes from its heap
in_use = blocks[::20] + blocks[-1:]
blocks.clear()
before = resident_memory_mb()
give_back_free_memory()
print(before - resident_memory_mb())
assert all(block.sum() == len(block) for block in in_use)
"""

FREE_LARGE_BLOCKS = """
import numpy as np

from racecar.pipelines.live.work.free_memory import keep_memory_together
from racecar.pipelines.files.report import resident_memory_mb

keep_memory_together()
np.ones(20 * 2**17)  # once freed, glibc takes far smaller ones from its heap
before = resident_memory_mb()
large, in_use = [], []
for _ in range(100):
    large.append(np.ones(2**17))
    in_use.append(np.ones(8000))  # too many for the gaps that the imports have left in the heap
large.clear()
print(resident_memory_mb() - before - sum(block.nbytes for block in in_use) / 1e6)
"""


def megabytes(script: str) -> float:
    """What a script prints."""
    command = [sys.executable, "-c", script]
    return float(subprocess.run(command, capture_output=True, check=True, text=True).stdout)


def test_what_lies_between_blocks_in_use_goes_back() -> None:
    assert megabytes(FREE_BETWEEN_BLOCKS) > 0.8 * 2000 * 0.064


def test_large_blocks_that_are_kept_apart_go_back_by_themselves() -> None:
    assert megabytes(FREE_LARGE_BLOCKS) < 5.0
