"""The command ``python -m benchmarks live``."""

import json
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.slow  # what the nodes make of a played bag, the tests above show
def test_the_benchmark_plays_to_both_nodes(tmp_path: Path) -> None:
    told = tmp_path / "live.json"
    arguments = ["live", "--seconds", "5", "--no-recorded", "--quiet", "--json", str(told)]
    done = subprocess.run([sys.executable, "-m", "benchmarks", *arguments], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    nodes = json.loads(told.read_text())["live"]["simulated"]
    assert set(nodes) == {"localizer", "mapper"}
    for figures in nodes.values():
        assert figures["posed"] == figures["received"] == figures["scans"] == 200
        assert figures["error_live_m"] < 0.05
        assert figures["peak_memory_mb"] >= max(figures["memory_mb_by_tenth"]) > 100.0
