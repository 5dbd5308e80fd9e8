"""The screen for mapping a bag."""

import signal
from collections.abc import Callable, Mapping
from functools import partial
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from racecar.maps.errors import UserError
from racecar.pipelines.bags.check import BagCheck
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.literal_markdown import literal
from racecar.pipelines.files.typed_path import typed_path
from racecar.pipelines.runs.batch.bag_search import bag_stem
from racecar.pipelines.runs.error_sentences import in_one_sentence
from racecar.pipelines.runs.map_outputs import MAP_NAMES
from racecar.pipelines.runs.map_run import OPTIMIZING
from racecar.pipelines.runs.mapping_job import MappingJob
from racecar.pipelines.runs.other_process import FreshProcess, ProcessDiedError
from racecar.pipelines.runs.output_places import free_folder
from racecar.pipelines.studio.map_bag.bag_work import (
    STOPPED,
    News,
    Progress,
    WrittenMap,
    check_and_tell,
    map_and_tell,
)
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.screen import Screen
from racecar.pipelines.studio.watched_car import WatchedCar
from racecar.sensors.findings import Finding


class MapBagScreen(Screen):
    """Selects a bag, checks it, and watches the process that maps it."""

    def __init__(
        self, page: Page, bags: Mapping[str, Path], config: Config, open_run: Callable[[Path], None]
    ) -> None:
        """``bags`` by the names in the list, at least one; ``open_run`` shows the contents of a folder."""
        self._page, self._bags, self._config, self._open_run = page, bags, config, open_run
        self._process: FreshProcess[BagCheck] | FreshProcess[WrittenMap] | None = None
        self._news: Connection | None = None
        self._chosen = next(iter(bags.values()))
        self._mapped: Path | None = None
        self._build_panel()
        self.watched = WatchedCar(page)
        """The latest map and car."""
        self.choose(next(iter(bags)))

    @property
    def is_idle(self) -> bool:
        """Whether no bag is being read."""
        return self._process is None

    @property
    def words(self) -> str:
        """The progress, and finally the result."""
        return str(self._words.content)

    @property
    def remarks(self) -> str:
        """Additional notes for the user."""
        return str(self._remarks.content)

    @property
    def would_be_lost(self) -> str:
        """The work that is lost if the screen is left now."""
        if self.is_idle:
            return ""
        return "The bag is still being read: stop it first, or press again to leave all the same."

    def step(self, seconds: float) -> None:
        """Receive messages from the process."""
        process = self._process
        is_over = process is not None and process.is_over
        self._hear()
        if process is not None and is_over:
            self._end(process)

    def draw(self) -> bool:
        """Draw the latest map and car, once."""
        return self.watched.draw()

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
        self._process = None

    def _build_panel(self) -> None:
        page, gui = self._page, self._page.gui
        with page.folder("Map a bag"):
            self._bag = gui.add_dropdown("Bag", list(self._bags))
            page.on_change(self._bag, self.choose)
            self._out: Any = gui.add_text("Save as", "")
            self._records = gui.add_checkbox(
                "Record each scan", False, hint="So that the time line shows it, as --record does."
            )
            self._buttons = [gui.add_button("Map it"), gui.add_button("Check it first", color="gray")]
            page.on_press(self._buttons[0], self.map_it)
            page.on_press(self._buttons[1], self.check_it)
        with page.folder("How it goes"):
            self._words = gui.add_markdown("")
            self._bar: Any = gui.add_progress_bar(0.0, visible=False)
            self._stop = gui.add_button("Stop here", color="orange", visible=False)
            page.on_press(self._stop, self.stop)
            self._open = gui.add_button("Open the result", visible=False)
            page.on_press(self._open, self.open_result)
            self._remarks = gui.add_markdown("")

    def choose(self, name: str) -> None:
        """Select one of the bags; its map goes to a folder named after it that holds none yet."""
        self._chosen = self._bags[name]
        self._propose(Path("runs", bag_stem(self._chosen)))
        if self.is_idle:
            self._words.content, self._remarks.content = literal(str(self._chosen)), ""

    def _propose(self, folder: Path) -> None:
        self._out.value = str(free_folder(folder, lambda: MAP_NAMES))

    def map_it(self) -> None:
        """Start mapping the selected bag. Raises UserError while a bag is read, and when the map would
        replace something, unless it is called again."""
        job = MappingJob(
            self._chosen.absolute(),
            typed_path(self._out.value).absolute(),
            self._config,
            record=self._records.value,
        )
        self._page.check_place(job.place, [job.bag])
        self._start(partial(map_and_tell, job))
        self._stop.label = "Stop here, and map what was read"

    def check_it(self) -> None:
        """Start checking the selected bag. Raises UserError while a bag is read."""
        self._start(partial(check_and_tell, self._chosen.absolute(), self._config.sensors))
        self._stop.label = "Stop"

    def stop(self) -> None:
        """Stop reading, and build the map from what was read."""
        if self._process is not None and self._stop.visible:
            self._stop.visible = False
            self._words.content = "Stopping …"
            self._process.ask_to_stop()

    def open_result(self) -> None:
        """Look at the most recent map."""
        if self._mapped is not None:
            self._open_run(self._mapped)

    def _start(self, work: Callable[[Connection], Any]) -> None:
        if not self.is_idle:
            raise UserError("A bag is being read already: stop it, or wait for its end.")
        self._news, told = Pipe(duplex=False)
        self._process = FreshProcess(partial(work, told))
        told.close()  # the process has its own end
        self.watched.forget()
        self._page.layers.begin_anew()
        self._remarks.content, self._words.content = "", "Starting …"
        self._show_buttons(is_working=True)

    def _hear(self) -> None:
        try:
            while self._news is not None and self._news.poll():
                self._take(self._news.recv())
        except EOFError:  # the process has sent everything
            self._news = None

    def _take(self, news: News) -> None:
        if not isinstance(news, Progress):
            self.watched.take(news)
            return
        self._bar.value = 100.0 * news.share
        if news.what == OPTIMIZING:
            self._stop.visible = False
        self._words.content = f"{news.what} … {self._length()}"

    def _length(self) -> str:
        glimpse = self.watched.glimpse
        if glimpse is None or glimpse.path is None or glimpse.loops is None:
            return ""
        path, loops = glimpse.path, len(glimpse.loops)
        metres = float(np.sum(np.hypot(*np.diff(path[:, :2], axis=0).T)))
        return f"{metres:.0f} m driven, {loops} loop {'closure' if loops == 1 else 'closures'}"

    def _end(self, process: FreshProcess[BagCheck] | FreshProcess[WrittenMap]) -> None:
        self._process = None
        self._show_buttons(is_working=False)
        try:
            result = process.result()
        except ProcessDiedError as death:
            self._words.content = _explained(death)
        except Exception as error:
            self._words.content = literal(in_one_sentence(error))
        else:
            self._show_result(result)

    def _show_result(self, result: BagCheck | WrittenMap) -> None:
        if isinstance(result, BagCheck):
            scans = result.facts["scans"]
            found = "to be noted:" if result.findings else "no problems were found."
            self._words.content = (
                f"{scans['count']} scans on {literal(scans['topic'])} in {scans['duration_s']:.0f} s; {found}"
            )
            self._remarks.content = _listed(result.findings)
            return
        self._mapped = result.folder
        if (typed := typed_path(self._out.value)).absolute() == result.folder:
            self._propose(typed)
        self._open.visible = True
        self._words.content = f"**{literal(result.summary)}**"
        self._remarks.content = "\n".join(f"- {literal(sentence)}" for sentence in result.warnings)

    def _show_buttons(self, *, is_working: bool) -> None:
        for button in self._buttons:
            button.disabled = is_working
        self._bar.visible = self._stop.visible = is_working
        self._bar.value = 0.0
        self._open.visible = False


def _listed(findings: list[Finding]) -> str:
    return "\n".join(_in_line(finding) for finding in findings)


def _in_line(finding: Finding) -> str:
    remedy = f" *{literal(finding.remedy)}*" if finding.remedy else ""
    return f"- **{finding.grade.value}**: {literal(finding.what)}{remedy}"


def _explained(death: ProcessDiedError) -> str:
    if death.exit_code == -signal.SIGTERM:
        return STOPPED
    return (
        "The process that read the bag was ended from outside, as the system does when memory runs out. Map "
        "the bag again while less else is running, or a part of it with `racecar map --duration`."
    )
