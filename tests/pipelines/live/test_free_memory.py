"""Memory that is free leaves the process, also what lies between blocks that are in use."""

import platform

import numpy as np
import pytest

from pipelines.live.free_memory import give_back_free_memory
from pipelines.report import resident_memory_mb

BLOCKS = 2000
NUMBERS = 8000
"""Of each block: 64 kB, which glibc takes from its heap."""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc gives memory back when told to")
def test_what_lies_between_blocks_in_use_goes_back() -> None:
    blocks = [np.ones(NUMBERS) for _ in range(BLOCKS)]
    in_use = blocks[::20] + blocks[-1:]
    blocks.clear()
    before = resident_memory_mb()
    give_back_free_memory()
    assert before - resident_memory_mb() > 0.8 * BLOCKS * 8 * NUMBERS / 1e6
    assert all(block.sum() == NUMBERS for block in in_use)
