"""``racecar experiment``, run as a user runs it."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.end_to_end.commands import Racecar
from tests.pipelines.studio.chromium import Tab, new_tab

NAMES = (
    *("sensor-model", "motion-model", "noise-sweep", "convergence"),
    *("autograde", "beams-and-particles", "real-run"),
)
TIMED = {"beams-and-particles-time", "real-run-time"}
"""Figures of measured times, which are not the same twice."""


def test_one_experiment_writes_table_figures_and_json(racecar: Racecar, tmp_path: Path) -> None:
    done = racecar(
        "experiment", "motion-model", "--out", tmp_path / "out", "--json", tmp_path / "figures.json"
    )
    assert "Standard deviation of the particles" in done.stdout
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"motion-model.md", "motion-model.png", "motion-model.svg", "report.json"}
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert figures["motion-model"]["with noise"]["deviation_m"][-1] > 0.02
    assert figures["inputs"]["settings"]["particles"] > 0


@pytest.fixture(scope="module")
def report(racecar: Racecar, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("all")
    done = racecar("experiment", "all", "--quick", "--out", out)
    assert str(out / "report.html") in done.stdout
    return out


@pytest.mark.slow
def test_all_of_them_are_on_one_page_that_a_browser_shows(
    chromium: Any, report: Path, tmp_path: Path
) -> None:
    alone = tmp_path / "alone.html"
    alone.write_bytes((report / "report.html").read_bytes())
    with new_tab(chromium, 900, 1200) as tab:
        page = Tab(tab)
        tab.goto(alone.as_uri())
        assert tab.evaluate("[...document.images].every(image => image.naturalWidth > 0)") is True
        assert tab.evaluate("[...document.querySelectorAll('section')].map(section => section.id)") == list(
            NAMES
        )
        figures = tab.evaluate("document.images.length")
        assert figures == len(list(report.glob("*.svg"))) >= 15
        assert tab.evaluate("document.querySelectorAll('figcaption').length") == figures
        assert tab.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        assert all(address.startswith(("file:", "data:")) for address in page.requests)
        tab.screenshot(path=tmp_path / "report.png")
    colors = np.asarray(Image.open(tmp_path / "report.png").convert("RGB")).reshape(-1, 3)
    assert len(np.unique(colors, axis=0)) > 200


@pytest.mark.slow
def test_the_same_seed_gives_the_same_figures(report: Path, racecar: Racecar, tmp_path: Path) -> None:
    racecar("experiment", "all", "--quick", "--out", tmp_path)
    for first in sorted(report.glob("*.svg")):
        if first.stem not in TIMED:
            assert (tmp_path / first.name).read_bytes() == first.read_bytes(), first.name


@pytest.mark.slow
def test_a_recording_of_ones_own(racecar: Racecar, drive: Path, tmp_path: Path) -> None:
    pose = ("--initial-pose", 0, 0, 0)
    racecar(
        *("experiment", "convergence", "--quick", "--bag", drive / "drive.bag", "--map", "building"),
        *(*pose, "--out", tmp_path / "convergence"),
    )
    assert {"convergence.png", "convergence-2.png"} <= {
        path.name for path in (tmp_path / "convergence").iterdir()
    }
    racecar(
        *("experiment", "real-run", drive / "drive.bag", "--map", "building", *pose),
        *("--end-pose", "1.0 0.0", "--out", tmp_path / "run"),
    )
    figures = json.loads((tmp_path / "run" / "report.json").read_text())["real-run"]
    assert figures["scans"] > 300
    assert np.mean(figures["shares_on_wall"]) > 0.9
    assert figures["end_error_m"] > 0
