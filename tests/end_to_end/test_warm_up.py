"""What ``make install`` compiles is all that the commands need."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

LOCALIZER = """
from racecar.localization.config import LocalizationConfig
from racecar.localization.warm_up import warm_up, warm_up_filter
"""


def compiled_by(cache: Path, *arguments: object) -> set[str]:
    """Names of all that is compiled once Python has run so."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    subprocess.run([sys.executable, *map(str, arguments)], env=environment, check=True)
    return {path.name for path in cache.rglob("*.nbc")}


@pytest.mark.slow
def test_what_a_second_process_compiles_is_what_the_localizer_needs(tmp_path: Path) -> None:
    filters = compiled_by(tmp_path / "filter", "-c", LOCALIZER + "warm_up_filter(LocalizationConfig())")
    whole = compiled_by(tmp_path / "all", "-c", LOCALIZER + "warm_up(LocalizationConfig())")
    assert len(filters) > 0.4 * len(whole)
    assert filters < whole


@pytest.mark.slow
def test_after_the_warm_up_a_demo_compiles_nothing(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    beforehand = compiled_by(cache, "-m", "racecar.pipelines.commands.warm_up")
    assert beforehand
    assert (
        compiled_by(
            cache, "-m", "racecar.pipelines.commands.cli", "demo", "--out", tmp_path / "demo", "--quiet"
        )
        == beforehand
    )
