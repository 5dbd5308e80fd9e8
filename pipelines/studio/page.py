"""The page: server, drawing, views and side panel; and the single worker thread.

Clicks become requests in a queue, which the worker processes between two frames. So no two threads ever use a
screen at once, however many pages are open.
"""

import io
import logging
import queue
import socket
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, redirect_stdout
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray
from viser import ClientHandle, CommandHandle, GuiEvent, GuiFolderHandle, SceneClickEvent

from racecar.maps.errors import UserError
from racecar.pipelines.runs.error_sentences import in_one_sentence, is_mendable_by_user
from racecar.pipelines.runs.output_places import OccupiedError, OutputFolder, check_places
from racecar.pipelines.studio.frame import Frame
from racecar.pipelines.studio.layers import Layers
from racecar.pipelines.studio.pace import Pace
from racecar.pipelines.studio.palette import DARK, LIGHT
from racecar.pipelines.studio.screen import Screen
from racecar.pipelines.studio.server.gate import LOOPBACK, Gate
from racecar.pipelines.studio.server.gated_server import gated_server
from racecar.pipelines.studio.server.secret import page_secret
from racecar.pipelines.studio.top_view import TopView, floor_point

FRAME = 0.05
"""Seconds between frames: 20 per second look smooth and leave processor time for other work."""
_SLOWEST_FRAME = 0.25
"""Maximum seconds of one step, so that a delayed page does not jump."""
_WARNED_FOR = 15.0
"""Seconds after a warning within which pressing again confirms: longer than the message is shown, and too
short to forget it."""
_MOST_REQUESTS = 1000
"""Maximum waiting requests. More come only from a misbehaving page, and are dropped."""

_LOOK_EVERY = 5.0
"""Seconds between checks that the page can still be reached. Chosen by judgement."""

_log = logging.getLogger(__name__)

Request = Callable[[], None]
ScreenT = TypeVar("ScreenT", bound=Screen)


class Page:
    """Serves its user, on this machine only."""

    def __init__(self, title: str, port: int) -> None:
        """Port 0 uses a free port. So does a port that is in use, with a message in the log."""
        self._requests: queue.Queue[Request] = queue.Queue(_MOST_REQUESTS)
        self._screen: Screen | None = None
        self._folders: list[GuiFolderHandle] = []
        self._keys: list[CommandHandle] = []
        self._stop = threading.Event()
        self._has_dropped = False
        self._told_loss, self._warned_until = "", 0.0
        _hush()
        self._secret = page_secret()
        self.server = gated_server(LOOPBACK, _usable(port), title, Gate(self._secret))
        self.gui = self.server.gui
        self.gui.main_panel.dock_right()
        self.frame = Frame(self.gui)
        self.layers = Layers(self.server, self.frame.show_legend)
        self._beside: Layers | None = None
        self._ground = LIGHT
        self.pace = Pace(self.server)
        self.view = TopView(self.server, self._take_drag)
        self.server.scene.world_axes.visible = False
        self.server.scene.configure_default_lights(enabled=False)  # nothing is lit, and shadows cost time
        self.server.scene.configure_environment_map(None)  # its shader takes software 6 s to compile
        self.server.scene.on_click()(cast(Any, self._click))  # may be a coroutine; its types do not say so
        dark = self.gui.add_checkbox("Dark", False, order=1e6)
        self.on_change(dark, self._paint_ground)
        self._paint_ground(is_dark=False)

    @property
    def address(self) -> str:
        """The page's address for a browser on this machine; anyone who knows it may use the page."""
        return f"http://{LOOPBACK}:{self.server.get_port()}/{self._secret}/"

    def enter(self, make_screen: Callable[[], Screen]) -> None:
        """Replace the screen. Call this in the worker, or before it runs."""
        if self._screen is not None:
            self._screen.close()
        self._screen = None
        for folder in self._folders:
            folder.remove()
        for key in self._keys:
            key.remove()
        self._folders.clear()
        self._keys.clear()
        self.layers.begin_anew()
        self.frame.begin_anew()
        self._clear_beside()
        self._screen = make_screen()

    def leave_for(self, prepare: Callable[[], Callable[[], Screen]]) -> None:
        """Enter the screen that ``prepare`` creates, which may raise UserError.

        Also raises UserError when something would be lost; a second call soon after enters it anyway.
        """
        self.confirm_leaving()
        self.enter(prepare())

    def confirm_leaving(self) -> None:
        """Raises UserError that says what would be lost with the screen, unless it has just said so."""
        loss = "" if self._screen is None else self._screen.would_be_lost
        if loss:
            self.confirm(loss)

    def rescue(self) -> str:
        """Save what would be lost with the screen, see `Screen.rescue`."""
        return "" if self._screen is None else self._screen.rescue()

    def check_place(self, place: OutputFolder, read: Sequence[Path] = ()) -> None:
        """Raises UserError when nothing can be written to a place, and when something there would be replaced
        unless this is called again soon."""
        try:
            check_places([place], read, replace=False)
        except OccupiedError as error:
            self.confirm(str(error.or_else("press again to replace it")))

    def confirm(self, loss: str) -> None:
        """Raises UserError that says what would be lost, unless it has just said so."""
        was_told = loss == self._told_loss and time.monotonic() < self._warned_until
        self._told_loss, self._warned_until = ("" if was_told else loss), time.monotonic() + _WARNED_FOR
        if not was_told:
            raise UserError(loss)

    def layers_beside(self, offset: NDArray[np.float64]) -> Layers:
        """Layers for a second drawing, moved by an offset (2,), until the screen is left; earlier ones are
        removed."""
        self._clear_beside()
        self.server.scene.add_frame("/beside", show_axes=False, position=(*offset, 0.0))
        self._beside = Layers(self.server, lambda _: None, "/beside")
        self._beside.lie_on(self._ground)
        self._beside.fit(self.view.pixel)
        return self._beside

    def _clear_beside(self) -> None:
        if self._beside is not None:
            self._beside.begin_anew()
            self._beside = None

    @property
    def _all_layers(self) -> list[Layers]:
        return [self.layers, *([] if self._beside is None else [self._beside])]

    def folder(self, label: str, *, is_open: bool = True) -> GuiFolderHandle:
        """A section of the side panel that is removed with the screen."""
        folder = self.gui.add_folder(label, expand_by_default=is_open)
        self._folders.append(folder)
        return folder

    def on_key(self, key: Any, action: Request, words: str, modifier: Any = None) -> None:
        """Have the worker execute an action when a key is pressed, until the screen is left. Keys are named
        as viser does, and listed with their words in its command palette."""
        command = self.gui.add_command(words, hotkey=key, modifier=modifier)
        self._keys.append(command)

        async def trigger(_: object) -> None:
            self.ask(action)

        command.on_trigger(trigger)

    def request(self, request: Request) -> None:
        """Have the worker execute a request, unless it has stopped; callable from any thread."""
        if self._stop.is_set():
            return
        try:
            self._requests.put_nowait(request)
        except queue.Full:
            if not self._has_dropped:
                _log.warning("The page asks for more than can be done; requests are dropped.")
            self._has_dropped = True

    def ask(self, request: Request) -> None:
        """Have the worker execute a user's request, unless another screen is entered before."""
        screen = self._screen
        self.request(lambda: request() if self._screen is screen else None)

    def on_press(self, button: Any, action: Request) -> None:
        """Have the worker execute an action when a button is pressed."""

        async def press(_: GuiEvent[Any]) -> None:
            self.ask(action)

        button.on_click(press)

    def on_change(self, control: Any, action: Callable[[Any], None]) -> None:
        """Have the worker execute an action with the value to which the user sets a control."""

        async def change(event: GuiEvent[Any]) -> None:
            if event.client is not None:  # not set by the worker itself
                value = control.value
                self.ask(lambda: action(value))

        control.on_update(change)

    def run(self) -> None:
        """Work until `stop`, or until the page can no longer be reached."""
        last = looked = time.monotonic()
        while not self._stop.is_set():
            self._take_requests()
            now = time.monotonic()
            if now - looked > _LOOK_EVERY:
                looked = now
                self._look()
            if self._screen is not None:
                self._survive(self._step, min(now - last, _SLOWEST_FRAME))
            last = now
            self._stop.wait(max(0.0, now + FRAME - time.monotonic()))

    def stop(self) -> None:
        """End `run`; callable from any thread."""
        self._stop.set()

    def close(self) -> None:
        """Stop serving."""
        if self._screen is not None:
            self._screen.close()
        with redirect_stdout(io.StringIO()):  # it announces its end, too
            self.server.stop()

    def tell(self, title: str, words: str, color: str = "blue") -> None:
        """Show a message on all pages."""
        for client in self.server.get_clients().values():
            _notify(client, title, words, color)

    def _look(self) -> None:
        """Stop when the server has ended, which nothing else would detect."""
        try:
            socket.create_connection((LOOPBACK, self.server.get_port()), _LOOK_EVERY).close()
        except OSError:
            _log.warning("The page at %s can no longer be reached, and is not drawn any more.", self.address)
            self.stop()

    def _step(self, seconds: float) -> None:
        if self._screen is None:
            return
        self._screen.step(seconds)
        if self.pace.has_pages and self.pace.is_ready:
            with self.server.atomic():
                are_zoomed = [layers.fit(self.view.pixel) for layers in self._all_layers]
                has_changed = self._screen.draw() or any(are_zoomed)
            if has_changed:
                self.pace.note_frame()

    def _take_requests(self) -> None:
        for _ in range(self._requests.qsize()):  # later ones wait for the next frame
            if self._stop.is_set():
                return
            self._survive(self._requests.get_nowait())

    def _survive(self, action: Callable[..., None], *arguments: Any) -> None:
        try:
            action(*arguments)
        except Exception as error:
            if is_mendable_by_user(error):
                self.tell("Not possible", in_one_sentence(error), "orange")
                return
            _log.exception("A request failed.")
            self.tell("This is a fault in racecar", f"{type(error).__name__}: {error}", "red")

    def _paint_ground(self, is_dark: bool) -> None:
        self._ground = DARK if is_dark else LIGHT
        self.gui.configure_theme(dark_mode=is_dark, show_logo=False, show_share_button=False)
        for layers in self._all_layers:
            layers.lie_on(self._ground)

    async def _click(self, event: SceneClickEvent) -> None:
        place, screen = floor_point(event.ray_origin, event.ray_direction), self._screen
        if screen is not None:
            self.ask(lambda: screen.tool.click(place))

    def _take_drag(self, phase: str, start: NDArray[np.float64], end: NDArray[np.float64]) -> bool:
        tool = None if self._screen is None else self._screen.tool
        if tool is None or not tool.takes_drag(start):
            return False
        self.ask(lambda: tool.drag(start, end, is_over=phase == "end"))
        return True


@contextmanager
def open_beside(
    title: str, port: int, make_screen: Callable[[Page], ScreenT]
) -> Iterator[tuple[Page, ScreenT]]:
    """A page with a screen during the block; the worker runs in its own thread."""
    with closing(Page(title, port)) as page:
        made: list[ScreenT] = []

        def make() -> ScreenT:
            made.append(make_screen(page))
            return made[0]

        page.enter(make)
        worker = threading.Thread(target=page.run, name="page", daemon=True)
        worker.start()
        try:
            yield page, made[0]
        finally:
            page.stop()
            worker.join()


def _hush() -> None:
    """Silence log messages about visitors who connect but send nothing, and about closed pages."""
    logging.getLogger("websockets").setLevel(logging.CRITICAL)
    warnings.filterwarnings("ignore", "Queued a .* on a closed connection")


def _usable(port: int) -> int:
    """The given port, or a free one if it is in use."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as the server does
        try:
            probe.bind((LOOPBACK, port))
        except OSError as error:
            probe.bind((LOOPBACK, 0))
            _log.warning("The page is not at port %d (%s): a free one is taken.", port, error.strerror)
        return int(probe.getsockname()[1])


def _notify(client: ClientHandle, title: str, words: str, color: Any) -> None:
    client.add_notification(title=title, body=words, color=color, auto_close_seconds=8.0)
