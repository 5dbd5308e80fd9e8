"""A headless Chromium on a page of the studio that runs meanwhile."""

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from racecar.pipelines.studio.page import Page, open_beside
from racecar.pipelines.studio.screen import Screen

_FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update"),
    *("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"),
)
"""WebGL runs on the processor, and the browser asks its maker for nothing."""
WIDTH, HEIGHT = 960, 600
"""Pixels, of which each costs a processor without graphics time."""
_PATIENCE = 120.0
"""Seconds: on a busy machine a page may take many to load."""


class Tab:
    """A page in a browser, whoever serves it."""

    def __init__(self, tab: Any) -> None:
        self.tab = tab
        self.requests: list[str] = []
        tab.set_default_timeout(1e3 * _PATIENCE)
        tab.on("request", lambda request: self.requests.append(request.url))
        tab.on("websocket", lambda socket: self.requests.append(socket.url))

    def wait_for(self, is_true: Callable[[], Any], what: str, explain: Callable[[], str] = str) -> None:
        """Ask again and again; fails the test when the time is over, with more words if there are."""
        end = time.monotonic() + _PATIENCE
        while time.monotonic() < end:
            if is_true():
                return
            self.tab.wait_for_timeout(100)
        pytest.fail(f"waited {_PATIENCE:.0f} s for {what} {explain()}")

    def says(self, words: str) -> bool:
        """Whether some words are to be read on the page."""
        return words in self.tab.inner_text("body")

    def press(self, name: str) -> None:
        """Press a button of the side panel."""
        self.tab.get_by_role("button", name=name, exact=True).click()

    def list_of(self, label: str) -> Any:
        """A list of the side panel from which one chooses."""
        return self.tab.get_by_label(label, exact=True).first

    def choose(self, label: str, option: str) -> None:
        """Choose from a list of the side panel."""
        self.list_of(label).click()
        self.tab.get_by_role("option", name=option, exact=True).click()


class Opened(Tab):
    """A page of the studio in a browser."""

    def __init__(self, tab: Any, studio: Page) -> None:
        super().__init__(tab)
        self.studio = studio

    def load(self) -> None:
        """Open the studio's page, and wait until it has drawn what there is."""
        before = len(self.studio.server.get_clients())
        self.tab.goto(self.studio.address)
        self.wait_for(lambda: len(self.studio.server.get_clients()) > before, "the page to connect")
        client = max(self.studio.server.get_clients().items())[1]
        client.local_storage.get_item("drawn", timeout=_PATIENCE)

    def pixels(self) -> NDArray[np.uint8]:
        """(rows, columns, 3) of the part of the page where only the map is."""
        clip = {"x": 300, "y": 20, "width": 320, "height": 560}
        return np.asarray(Image.open(BytesIO(self.tab.screenshot(clip=clip))).convert("RGB"))

    def screen_of(self, place: tuple[float, float]) -> tuple[float, float]:
        """Where a place of the floor is on the screen, in pixels."""
        camera = next(iter(self.studio.server.get_clients().values())).camera
        box = self.tab.locator("canvas").first.bounding_box()
        scale = box["height"] / (2.0 * camera.position[2] * np.tan(camera.fov / 2.0))
        x, y = scale * (np.array(place) - camera.position[:2])
        return float(box["x"] + box["width"] / 2.0 + x), float(box["y"] + box["height"] / 2.0 - y)

    def click(self, place: tuple[float, float]) -> None:
        """Click on a place of the floor."""
        self.tab.mouse.click(*self.screen_of(place))

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag from one place of the floor to another."""
        a, b = self.screen_of(start), self.screen_of(end)
        self.tab.mouse.move(*a)
        self.tab.mouse.down()
        self.tab.mouse.move(*b, steps=8)
        self.tab.wait_for_timeout(150)
        self.tab.mouse.up()

    @property
    def asked_hosts(self) -> set[str | None]:
        """All that the page turned to."""
        return {urlsplit(url.removeprefix("blob:")).hostname for url in self.requests}


@contextmanager
def browser() -> Iterator[Any]:
    """A Chromium; skips the test where playwright or Chromium are missing."""
    sync_api = pytest.importorskip("playwright.sync_api")
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("there is no Chromium; install it with: apt-get install chromium")
    with sync_api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=program, args=_FLAGS)
        try:
            yield chromium
        finally:
            chromium.close()


@contextmanager
def running(make_screen: Callable[[Page], Screen]) -> Iterator[Page]:
    """A studio with a screen, whose worker runs in a thread meanwhile."""
    with open_beside("racecar studio", 0, make_screen) as (studio, _):
        yield studio


@contextmanager
def new_tab(chromium: Any, width: int = WIDTH, height: int = HEIGHT) -> Iterator[Any]:
    """An empty one, of so many pixels."""
    tab = chromium.new_page(viewport={"width": width, "height": height})
    try:
        yield tab
    finally:
        tab.close()


@contextmanager
def opened(chromium: Any, studio: Page) -> Iterator[Opened]:
    """The studio's page in a tab of its own."""
    with new_tab(chromium) as tab:
        page = Opened(tab, studio)
        page.load()
        yield page
