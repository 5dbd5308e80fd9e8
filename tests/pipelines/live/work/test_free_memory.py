"""Memory that is free leaves the process, also what lies between blocks that are in use."""

import platform
import subprocess
import sys

import numpy as np
import pytest

from racecar.pipelines.files.report import resident_memory_mb
from racecar.pipelines.live.work.free_memory import give_back_free_memory

BLOCKS = 2000
NUMBERS = 8000
"""Of each block: 64 kB, which glibc takes from its heap."""


only_glibc = pytest.mark.skipif(
    platform.libc_ver()[0] != "glibc", reason="only glibc gives memory back when told to"
)


@only_glibc
def test_what_lies_between_blocks_in_use_goes_back() -> None:
    blocks = [np.ones(NUMBERS) for _ in range(BLOCKS)]
    in_use = blocks[::20] + blocks[-1:]
    blocks.clear()
    before = resident_memory_mb()
    give_back_free_memory()
    assert before - resident_memory_mb() > 0.8 * BLOCKS * 8 * NUMBERS / 1e6
    assert all(block.sum() == NUMBERS for block in in_use)


FREE_LARGE_BLOCKS = """
import sys

import numpy as np

from racecar.pipelines.live.work.free_memory import keep_memory_together
from racecar.pipelines.files.report import resident_memory_mb

if sys.argv[1] == "apart":
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


def left_of_large_blocks(how: str) -> float:
    """Megabytes that 100 freed ones leave in a process of its own, with a small one in use after each."""
    command = [sys.executable, "-c", FREE_LARGE_BLOCKS, how]
    return float(subprocess.run(command, capture_output=True, check=True, text=True).stdout)


@only_glibc
def test_large_blocks_that_are_kept_apart_go_back_by_themselves() -> None:
    assert left_of_large_blocks("as usual") > 80.0
    assert left_of_large_blocks("apart") < 5.0
