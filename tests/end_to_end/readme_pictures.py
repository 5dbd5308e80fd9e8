"""``python tests/end_to_end/readme_pictures.py docs`` makes the pictures of the README; needs Chromium."""

import subprocess
import sys
import tempfile
from pathlib import Path

from browser import open_browser
from PIL import Image
from viewing import pixels_of, viewed

_FIGURES = ("noise-sweep", "autograde", "beams-and-particles-time", "motion-model")
_WIDTH = 700
"""Pixels; enough to be read on a page."""


def main(folder: Path) -> None:
    """Drive, localize, look; run the experiments; keep small copies of what is seen."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary)
        _racecar("simulate", "--map", "building", "--out", work / "drive.bag", "--seed", 3, "--duration", 40)
        run = ("localize", work / "drive.bag", "--map", "building", "--initial-pose", 0, 0, 0, "--record")
        _racecar(*run, "--out", work / "drive")
        with viewed(work / "drive") as address, open_browser() as browser:
            browser.open(address)
            browser.wait_until(lambda: pixels_of(browser, work / "view.png").complete, 90, "the viewer")
        _shrink(work / "view.png", folder / "view.png", 1400)
        _racecar("experiment", "all", "--out", work / "report")
        with open_browser(900, 1000) as browser:
            browser.open((work / "report" / "report.html").as_uri())
            browser.wait_until(lambda: browser.ask("document.readyState") == "complete", 60, "the report")
            browser.screenshot(work / "report.png")
        _shrink(work / "report.png", folder / "report.png", 900)
        for name in _FIGURES:
            _shrink(work / "report" / f"{name}.png", folder / f"{name}.png", _WIDTH)


def _racecar(*arguments: object) -> None:
    subprocess.run([sys.executable, "-m", "pipelines.cli", *map(str, arguments)], check=True)


def _shrink(source: Path, target: Path, width: int) -> None:
    """Not wider than so many pixels, and of 128 colours, which figures are content with."""
    picture = Image.open(source).convert("RGB")
    picture.thumbnail((width, 10_000))
    picture.quantize(128).save(target, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
