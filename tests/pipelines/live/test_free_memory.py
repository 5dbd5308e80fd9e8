"""Memory that is free leaves the process, also what lies between blocks that are in use."""

import platform

import numpy as np
import pytest

from pipelines.live.free_memory import give_back_free_memory, keep_large_blocks_apart
from pipelines.other_process import in_fresh_process
from pipelines.report import resident_memory_mb

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


def left_of_large_blocks() -> float:
    """Megabytes that 100 freed ones leave, with a small one in use after each, once a far larger one was."""
    np.ones(20 * 2**17)
    before = resident_memory_mb()
    large, in_use = [], []
    for _ in range(100):
        large.append(np.ones(2**17))
        in_use.append(np.ones(1000))
    large.clear()
    return resident_memory_mb() - before


def left_of_blocks_apart() -> float:
    keep_large_blocks_apart()
    return left_of_large_blocks()


@only_glibc
def test_large_blocks_that_are_kept_apart_go_back_by_themselves() -> None:
    assert in_fresh_process(left_of_large_blocks) > 80.0
    assert in_fresh_process(left_of_blocks_apart) < 5.0
