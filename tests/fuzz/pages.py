"""A page of the studio, and what is said to it by whatever may be at the other end."""

import gc
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from websockets.exceptions import ConnectionClosed

from racecar.maps.map_files import load_map
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.screen import Screen
from racecar.pipelines.studio.studio import add_opening, drive, edit
from racecar.pipelines.studio.watch.watch_screen import WatchScreen
from tests.pipelines.studio.server.visitor import VIEW, visiting

_PATIENCE = 60.0
"""Seconds for which a page may be busy with what was said: a filter is loaded for a map that is opened."""
_TYPED = (
    "room.yaml",
    "run",
    ".",
    "",
    "~",
    "~nobody",
    "\0",
    "x" * 4000,
    "ü" * 300,
    "/dev/zero",
    "/proc/self",
    "a/b",
)
"""Into fields for text; those that can be written to lie in the folder of the trial."""

SAID = "page.said"
"""The file of what is said: messages, one after the other."""


def sound_messages() -> list[dict[str, Any]]:
    """What the page of a busy person says. Controls are named by their place in the panel, and what is set of
    them by how much, from 0 to 1, of what can be."""
    said: list[dict[str, Any]] = [VIEW, {**VIEW, "position": [1.0, 0.5, 30.0], "look_at": [1.0, 0.5, 0.0]}]
    for x, y in ((1.0, 0.0), (-1.0, 2.0), (2.0, -2.0), (1.0, 0.0)):
        said.append(
            {
                "type": "ScenePointerMessage",
                "event_type": "click",
                "ray_origin": [0.0, 0.0, 60.0],
                "ray_direction": [x / 60.0, y / 60.0, -0.99],
                "screen_pos": [[0.5, 0.5]],
                "modifier": None,
            }
        )
    for phase, x in (("start", 1.0), ("update", 1.5), ("end", 2.0)):
        said.append(
            {
                "type": "SceneNodeDragMessage",
                "phase": phase,
                "name": "/glass",
                "instance_index": None,
                "start_position": [1.0, 0.0, 0.03],
                "start_screen_pos": [0.5, 0.5],
                "end_position": [x, 0.5, 0.03],
                "end_screen_pos": [0.6, 0.4],
                "button": "left",
                "modifier": None,
                "owner": "",
            }
        )
    said.append(
        {"type": "LocalStorageGetItemResponseMessage", "value": None, "error": None, "request_uuid": ""}
    )
    for number in range(40):
        control = {"control": number}
        said.append({"type": "GuiUpdateMessage", "uuid": control, "updates": {"value": {"of": number / 40}}})
        said.append({"type": "GuiButtonHoldMessage", "uuid": control, "frequency": 5.0})
    return said


def page_action(kind: str) -> int:
    """Say all that to a page, and see whether it still does its work."""
    frames = list(_frames(Path(SAID).read_bytes()))
    with closing(Page("a page", 0)) as page:
        page.enter(_SCREENS[kind](page))
        add_opening(page, Config())
        _controls(page)[-2].value = "room.yaml"  # what it offers to open takes too long here
        worker = threading.Thread(target=page.run)
        worker.start()
        try:
            _say(page, frames)
            is_well = _does_its_work(page)
        finally:
            page.stop()
            worker.join(_PATIENCE)
        gc.collect()  # asyncio tells of tasks that have failed when they are forgotten
    return 0 if is_well else 1


def _frames(said: bytes) -> Iterator[Any]:
    try:
        messages = msgspec.msgpack.decode(said)
    except (ValueError, RecursionError):
        messages = said
    yield from messages if isinstance(messages, list) else [said]


def _say(page: Page, frames: list[Any]) -> None:
    for _ in range(1 + len(frames)):  # too long a frame ends a connection
        with visiting(page) as connection:
            try:
                while frames:
                    frame = frames.pop(0)
                    connection.send(frame if isinstance(frame, bytes | str) else _encoded(frame, page))
            except ConnectionClosed:
                continue
            return


def _does_its_work(page: Page) -> bool:
    """Whether requests are done, and another page would be shown something."""
    done = threading.Event()
    page.request(done.set)
    with visiting(page) as connection:
        return done.wait(_PATIENCE) and bool(connection.recv(_PATIENCE))


def _encoded(frame: Any, page: Page) -> bytes:
    """A message, with the controls as they are at the moment."""
    match frame:
        case {"uuid": {"control": int(number)}}:
            controls = _controls(page)
            control = controls[number % len(controls)]
            frame = {**frame, "uuid": control._impl.uuid}
            match frame.get("updates"):
                case {"value": {"of": float(share)}} if 0.0 <= share <= 1.0:
                    frame["updates"] = {"value": _value(control, share)}
    return msgspec.msgpack.encode(frame)


def _controls(page: Page) -> list[Any]:
    """In the order in which they were made."""
    return list(page.server.gui._gui_input_handle_from_uuid.values())


def _value(control: Any, share: float) -> Any:
    """So much of what can be set of a control."""
    options = _TYPED if isinstance(control.value, str) else (False, True)
    options = getattr(control, "options", options)
    if hasattr(control, "min"):
        least, most = control.min or 0.0, control.max or 10.0
        return least + share * (most - least)
    return options[min(int(share * len(options)), len(options) - 1)]


def _watch(page: Page) -> Callable[[], Screen]:
    def make() -> Screen:
        screen = WatchScreen(page, tells_places=True)
        screen.connect(lambda goal: "It went away.", lambda place: "It went away.")
        screen.show_map(load_map(Path("room.yaml")))
        screen.show(np.zeros(3), np.zeros((1, 2)), np.zeros((1, 3)))
        return screen

    return make


_SCREENS: Mapping[str, Callable[[Page], Callable[[], Screen]]] = {
    "watch": _watch,
    "drive": lambda page: drive(page, Path("room.yaml"), Config()),
    "edit": lambda page: edit(page, Path("run"), Config()),
}
SCREENS = tuple(_SCREENS)
