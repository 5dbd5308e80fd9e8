"""What is heard of a page, and what is not."""

import math
import threading
from collections.abc import Iterator
from contextlib import closing
from typing import Any

import msgspec
import pytest
from websockets.exceptions import ConnectionClosedError

from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.server.hearing import LONGEST_MESSAGE, is_heard
from tests.fuzz.pages import sound_messages
from tests.pipelines.studio.server.visitor import VIEW, say, visiting

CLICK, DRAG, PULSE = (
    next(message for message in sound_messages() if message["type"] == kind)
    for kind in ("ScenePointerMessage", "SceneNodeDragMessage", "LocalStorageGetItemResponseMessage")
)


class Panel:
    """A page with controls of all kinds, and what was heard of them."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.heard: list[Any] = []
        gui = page.gui
        self._controls: dict[str, Any] = {
            "choice": gui.add_dropdown("choice", ["a", "b"]),
            "slider": gui.add_slider("slider", 1.0, 2.0, 0.1, 1.5),
            "number": gui.add_number("number", 1.0, min=0.0),
            "text": gui.add_text("text", "a"),
            "check": gui.add_checkbox("check", False),
            "hidden": gui.add_checkbox("hidden", False, visible=False),
            "disabled": gui.add_text("disabled", "a", disabled=True),
            "button": gui.add_button("button"),
        }
        for control in list(self._controls.values())[:-1]:
            page.on_change(control, self.heard.append)
        page.on_press(self._controls["button"], lambda: self.heard.append("pressed"))
        self._controls["bar"] = gui.add_progress_bar(0.0)
        self._controls["key"] = gui.add_command("key", hotkey="K")

    def change(self, name: str, value: Any) -> dict[str, Any]:
        """The message that sets a control."""
        uuid = self._controls[name]._impl.uuid
        return {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}}

    def trigger(self, name: str) -> dict[str, Any]:
        """The message that a key is pressed, if there is one."""
        return {"type": "CommandTriggerMessage", "uuid": self._controls[name]._impl.uuid}

    def hears(self, message: Any) -> bool:
        """Whether a message is heard."""
        controls = {control._impl.uuid: control for control in self._controls.values()}
        return is_heard(msgspec.msgpack.encode(message), controls.get)


@pytest.fixture(scope="module")
def panel() -> Iterator[Panel]:
    with closing(Page("a page", 0)) as page:
        yield Panel(page)


@pytest.mark.parametrize("message", [VIEW, CLICK, DRAG, PULSE])
def test_what_a_person_does_is_heard(panel: Panel, message: dict[str, Any]) -> None:
    assert panel.hears(message)


@pytest.mark.parametrize("odd", [math.nan, math.inf, -1e300, 2**63, None, "1", [], {}, True])
@pytest.mark.parametrize(
    ("message", "field"),
    [
        (VIEW, "position"),
        (VIEW, "look_at"),
        (CLICK, "ray_origin"),
        (CLICK, "ray_direction"),
        (DRAG, "end_position"),
    ],
)
def test_no_place_is_far_off_or_no_number(
    panel: Panel, message: dict[str, Any], field: str, odd: Any
) -> None:
    assert not panel.hears({**message, field: [odd, *message[field][1:]]})
    assert not panel.hears({**message, field: odd})
    assert not panel.hears({**message, field: [*message[field], 0.0]})


@pytest.mark.parametrize(
    "changed",
    [
        {"image_height": 0},
        {"image_width": -5},
        {"fov": 0.0},
        {"fov": math.pi},
        {"far": math.inf},
        {"look_at": VIEW["position"]},
    ],
)
def test_no_view_is_without_a_size_or_a_direction(panel: Panel, changed: dict[str, Any]) -> None:
    assert not panel.hears({**VIEW, **changed})


def test_a_ray_leads_to_the_floor(panel: Panel) -> None:
    assert panel.hears({**CLICK, "ray_direction": [0.0, 0.0, -1.0000000000000002]})
    for down in (0.0, 0.5, -1e-9):
        assert not panel.hears({**CLICK, "ray_direction": [0.1, 0.1, down]})


@pytest.mark.parametrize(
    ("name", "value", "is_right"),
    [
        ("choice", "b", True),
        ("choice", "c", False),
        ("choice", 0, False),
        ("slider", 2, True),
        ("slider", 2.5, False),
        ("slider", math.nan, False),
        ("slider", "2", False),
        ("slider", True, False),
        ("number", 1e5, True),
        ("number", -1, False),
        ("number", 1e300, False),
        ("text", "x" * 4096, True),
        ("text", "x" * 4097, False),
        ("text", 5, False),
        ("text", ["a"], False),
        ("check", True, True),
        ("check", 1, False),
        ("hidden", True, False),
        ("disabled", "b", False),
        ("button", True, True),
        ("button", {}, False),
        ("bar", 50.0, False),
    ],
)
def test_a_control_is_set_to_what_a_person_can_set(
    panel: Panel, name: str, value: Any, is_right: bool
) -> None:
    assert panel.hears(panel.change(name, value)) == is_right


def test_keys_are_heard_and_nothing_else_is_taken_for_one(panel: Panel) -> None:
    assert panel.hears(panel.trigger("key"))
    assert not panel.hears(panel.trigger("button"))
    assert not panel.hears(panel.change("key", True))
    assert not panel.hears({"type": "CommandTriggerMessage", "uuid": "another"})


@pytest.mark.parametrize(
    "updates", [{}, {"visible": True}, {"update_cb": []}, {"value": "b", "options": ["c"]}, None]
)
def test_nothing_else_of_a_control_is_set(panel: Panel, updates: Any) -> None:
    assert not panel.hears({**panel.change("choice", "b"), "updates": updates})


@pytest.mark.parametrize(
    "kind", ["ShareUrlRequest", "GuiFormDirtyMessage", "FileTransferPart", "", None, 7, []]
)
def test_no_other_message_is_heard(panel: Panel, kind: Any) -> None:
    assert not panel.hears({**panel.change("text", "b"), "type": kind})
    assert not panel.hears({"type": kind})


@pytest.mark.parametrize(
    "said", ["text", b"", b"\xc1", b"\x91" * 60_000, b"\xdd\xff\xff\xff\xff", b"\x81\x80\x01"]
)
def test_what_is_no_message_is_not_heard(said: str | bytes) -> None:
    assert not is_heard(said, lambda uuid: None)


def test_a_page_that_says_anything_stops_nothing(
    caplog: pytest.LogCaptureFixture, capsys: pytest.CaptureFixture[str]
) -> None:
    with closing(Page("a page", 0)) as page:
        panel, done = Panel(page), threading.Event()
        worker = threading.Thread(target=page.run)
        worker.start()
        try:
            with visiting(page) as connection:
                say(connection, VIEW)
                for message in ({**VIEW, "position": [math.nan] * 3}, panel.change("choice", "c"), [], None):
                    say(connection, message)
                for said in ("text", b"\xc1", bytes(LONGEST_MESSAGE)):
                    connection.send(said)
                say(connection, panel.change("choice", "b"))
                say(connection, panel.change("button", True))
                while "pressed" not in panel.heard:
                    connection.recv(10.0)
                with pytest.raises(ConnectionClosedError, match="1009"):
                    for _ in range(1000):
                        connection.send(bytes(LONGEST_MESSAGE + 1))
                        connection.recv(10.0)
            page.request(done.set)
            assert done.wait(10.0)
        finally:
            page.stop()
            worker.join()
    assert panel.heard == ["b", "pressed"]
    assert not caplog.messages
    assert not capsys.readouterr().err
