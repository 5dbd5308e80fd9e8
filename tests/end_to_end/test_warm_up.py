"""What ``make install`` compiles is all that the commands need."""

import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.slow
def test_after_the_warm_up_a_demo_compiles_nothing(tmp_path: Path) -> None:
    cache = tmp_path / "cache"

    def compiled_by(*arguments: object) -> set[str]:
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
        subprocess.run([sys.executable, "-m", *map(str, arguments)], env=environment, check=True)
        return {path.name for path in cache.rglob("*.nbc")}

    beforehand = compiled_by("pipelines.warm_up")
    assert beforehand
    assert compiled_by("pipelines.cli", "demo", "--out", tmp_path / "demo", "--quiet") == beforehand
