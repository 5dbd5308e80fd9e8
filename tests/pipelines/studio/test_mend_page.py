"""Wrong maps are corrected on the page, by clicks in a browser."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.mapping.mending.manual_constraints import Distrust, ManualConstraint, NotSamePlace, SamePlace
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import compose
from racecar.pipelines.files.config_file import load_config
from racecar.pipelines.files.edits_file import MapEdits, edits_beside
from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.files.session_file import load_session
from racecar.pipelines.studio.mend.correcting_process import CorrectingProcess
from racecar.pipelines.studio.mend.corrector import CorrectedMap, Corrector
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.server.gate import LOOPBACK
from racecar.pipelines.studio.studio import mend
from tests.mapping.mending.bent import error
from tests.mapping.mending.test_mender import TRUE
from tests.pipelines.studio.chromium import Opened, opened, running
from tests.pipelines.studio.mending import run_of, unclosed, wrongly_closed

MOST_CLICKS = 6


class Clicking:
    """Counts clicks."""

    def __init__(self, page: Opened) -> None:
        self.page, self.clicks = page, 0

    def press(self, name: str) -> None:
        self.clicks += 1
        self.page.press(name)

    def press_first_doubt(self) -> None:
        self.press(self.doubts[0])

    @property
    def doubts(self) -> list[str]:
        names = self.page.tab.get_by_role("button").all_inner_texts()
        return [name for name in names if name[:1].isdigit() and ": " in name]

    def wait_for_doubts(self) -> None:
        self.page.wait_for(lambda: self.doubts, "the list of doubts")

    def wait_for(self, words: str) -> None:
        self.page.wait_for(lambda: self.page.says(words), words)

    def keep_and_save(self) -> None:
        self.press("Keep")
        self.press("Save and render")
        self.wait_for("was rendered into")


@contextmanager
def correcting(chromium: Any, folder: Path) -> Iterator[Clicking]:
    def make(studio: Page) -> Any:
        return mend(studio, folder, load_config(None))()

    with running(make) as studio, opened(chromium, studio) as page:
        yield Clicking(page)


def chosen(page: Opened) -> str:
    """The name of the chosen constraint."""
    return str(page.list_of("Chosen").input_value())


def constraints(folder: Path) -> tuple[ManualConstraint, ...]:
    return edits_beside(folder).constraints


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "answer", "kind", "most_error"),
    [
        (unclosed, "Same place", SamePlace, 0.2),
        (wrongly_closed, "Not the same place", NotSamePlace, 0.05),
    ],
)
def test_a_fault_is_found_in_the_list_and_corrected_by_few_clicks(
    chromium: Any, tmp_path: Path, make: Callable[[], Session], answer: str, kind: type, most_error: float
) -> None:
    folder = run_of(make(), tmp_path / "run")
    with correcting(chromium, folder) as clicking:
        clicking.wait_for_doubts()
        clicking.wait_for("The map is wrong")
        clicking.press_first_doubt()
        clicking.wait_for("second pass, ")
        clicking.press(answer)
        clicking.wait_for("A preview, not kept yet.")
        assert constraints(folder) == ()
        clicking.keep_and_save()
        assert clicking.clicks <= MOST_CLICKS
        assert clicking.page.asked_hosts == {LOOPBACK}
    assert [type(each) for each in constraints(folder)] == [kind]
    assert error(make(), TRUE) > 5.0 * most_error
    assert error(load_session(folder), TRUE) < most_error
    assert read_report(folder).quality.verdict != "wrong"


@pytest.mark.slow
def test_clicks_on_the_map_a_drag_a_refusal_and_a_removal(chromium: Any, tmp_path: Path) -> None:
    folder = run_of(wrongly_closed(), tmp_path / "run")
    with correcting(chromium, folder) as clicking:
        page = clicking.page
        clicking.press("Same place")  # before there is a map, so it waits
        clicking.wait_for("Choose two moments first")
        clicking.wait_for_doubts()
        session = load_session(folder)
        for keyframe in (40, 60):
            page.tab.wait_for_timeout(600)  # two clicks at once would zoom
            page.click(tuple(session.map_from_base[keyframe, :2]))
        clicking.wait_for("second pass, ")
        clicking.press("Not the same place")
        clicking.wait_for("It was refused. Nothing ties")
        page.tab.get_by_text("More to state").click()
        clicking.press("Distrust the wheels")
        clicking.press("Keep")
        page.tab.get_by_text("Constraints", exact=True).click()
        page.wait_for(lambda: chosen(page).startswith("1: wheels distrusted: "), "the kept constraint")
        clicking.press("Back to the run")
        clicking.wait_for("is not saved")
        clicking.press("Save and render")
        clicking.wait_for("was rendered into")
        assert [type(each) for each in constraints(folder)] == [Distrust]
        clicking.wait_for_doubts()
        page.tab.get_by_text("Constraints", exact=True).click()
        clicking.press("Remove the chosen one")
        clicking.wait_for("A preview, not kept yet.")
        page.wait_for(lambda: not page.says("was rendered into"), "the message of the first time to go")
        clicking.keep_and_save()
    assert constraints(folder) == ()
    again, before = load_session(folder), wrongly_closed()
    np.testing.assert_allclose(again.map_from_keyframe, before.map_from_keyframe, atol=1e-9)


@pytest.mark.slow
def test_the_second_pass_is_dragged_onto_the_first(chromium: Any, tmp_path: Path) -> None:
    folder = run_of(unclosed(), tmp_path / "run")
    with correcting(chromium, folder) as clicking:
        clicking.wait_for_doubts()
        clicking.press_first_doubt()
        clicking.wait_for("second pass, ")
        page, session = clicking.page, load_session(folder)
        second = float(page.tab.get_by_label("Second (s)").first.input_value())
        keyframe = int(np.argmin(np.abs(session.times.seconds - second)))
        seen = session.keyframes.points_of(keyframe)
        grabbed = compose(session.map_from_keyframe[keyframe], np.array([*seen[len(seen) // 2], 0.0]))[:2]
        page.tab.wait_for_timeout(1000)
        page.drag(tuple(grabbed), tuple(grabbed + np.array([0.1, 0.1])))
        clicking.press("Same place")
        clicking.wait_for("A preview, not kept yet.")
        clicking.keep_and_save()
    (constraint,) = constraints(folder)
    assert isinstance(constraint, SamePlace)
    assert constraint.first_from_second is not None
    assert error(load_session(folder), TRUE) < 0.2


def test_a_process_that_was_ended_is_told_and_started_again(tmp_path: Path) -> None:
    process = CorrectingProcess(run_of(wrongly_closed(), tmp_path / "run"), MappingConfig())
    try:
        process.ask(_map)
        assert isinstance(_answer(process), CorrectedMap)
        assert process._process is not None
        process.ask(_end)
        with pytest.raises(Exception, match="ended from outside"):
            _answer(process)
        process.ask(_map)
        assert isinstance(_answer(process), CorrectedMap)
    finally:
        process.close()


def _answer(process: CorrectingProcess) -> object:
    while process.is_busy:
        assert process._pipe is not None
        process._pipe.poll(60.0)
        if (answer := process.answer()) is not None:
            return answer
    return None


def _map(corrector: Corrector) -> CorrectedMap:
    return corrector.map_with(MapEdits())


def _end(_: Corrector) -> None:
    import os
    import signal

    os.kill(os.getpid(), signal.SIGKILL)
