"""``python -m tests.end_to_end.readme_pictures docs/pictures`` makes the pictures of README and docs; needs
Chromium."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

from tests.end_to_end.viewing import SCREEN, pixels_of, viewed
from tests.pipelines.studio.chromium import Tab, browser, new_tab

_FIGURES = ("noise-sweep", "autograde")
_WIDTH = 700
"""Pixels; enough to be read on a page."""
_MAP_WIDTH, _MAP_COLOURS = 900, 64
"""Pixels, and colours that keep the first picture of the README small."""
_NOTE = "Software WebGL rendering detected"
"""What viser tells those whose browser draws without a graphics card."""


def main(folder: Path) -> None:
    """Look at a run, and keep small copies of what is seen and of the experiments' figures."""
    folder = folder.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)  # the viewer shows the names of files: short ones
        show_map(folder)
        show_run(folder)
        show_experiments(folder)


def show_map(folder: Path) -> None:
    """The map that the demo makes."""
    _racecar("demo", "--out", "demo")
    picture = Image.open("demo/map/map.png").convert("RGB")
    picture.thumbnail((_MAP_WIDTH, 10 * _MAP_WIDTH))
    picture.quantize(_MAP_COLOURS).save(folder / "map.png", optimize=True)


def show_run(folder: Path) -> None:
    """A drive through the building, localized, in the viewer."""
    _racecar("simulate", "--map", "building", "--out", "drive.bag", "--seed", 3, "--duration", 40)
    pose = ("--initial-pose", 0, 0, 0)
    _racecar("localize", "drive.bag", "--map", "building", *pose, "--record", "--out", "drive")
    with viewed(Path("drive")) as address, browser() as chromium, new_tab(chromium, *SCREEN) as tab:
        tab.goto(address)
        page = Tab(tab)
        page.wait_for(lambda: page.says(_NOTE), "the page")
        tab.locator(".mantine-Notification-closeButton").first.click()
        bar = tab.get_by_test_id("lanes").bounding_box()
        tab.mouse.click(bar["x"] + bar["width"] / 2.0, bar["y"] + bar["height"] / 2.0)
        page.wait_for(lambda: not page.says(_NOTE), "the note to go")
        page.wait_for(lambda: pixels_of(tab, folder / "view.png").complete, "the viewer")


def show_experiments(folder: Path) -> None:
    """Their figures, small enough for a page."""
    for name in _FIGURES:
        _racecar("experiment", name, "--out", name)
        picture = Image.open(f"{name}/{name}.png").convert("RGB")
        picture.thumbnail((_WIDTH, 10 * _WIDTH))
        picture.save(folder / f"{name}.png", optimize=True)


def _racecar(*arguments: object) -> None:
    subprocess.run([sys.executable, "-m", "racecar.pipelines.commands.cli", *map(str, arguments)], check=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
