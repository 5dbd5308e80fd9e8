"""The map so far, as it is saved while the car drives."""

from pathlib import Path

import numpy as np
import pytest

from racecar.mapping.session.session import Session
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.files.session_file import load_session
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.live.saving import unfinished_map
from racecar.pipelines.live.saving.map_saving import MapOutput
from racecar.pipelines.live.saving.unfinished_map import UnfinishedMap
from racecar.pipelines.runs.map_outputs import MAP_FILES
from tests.pipelines.live.test_map_saving import laps, mapped


@pytest.fixture(scope="module")
def session() -> Session:
    return mapped(laps(20.0)).session()


def grid(value: int) -> OccupancyGrid:
    return OccupancyGrid(np.full((4, 5), value, dtype=np.int8), 0.05, np.zeros(3))


def shown_in(folder: Path) -> int:
    return int(load_map(folder).cells[0, 0])


@pytest.fixture
def unfinished(tmp_path: Path) -> UnfinishedMap:
    def say(sentence: str) -> None:
        raise AssertionError(sentence)

    output = MapOutput(tmp_path / "out", Config(), {"live": True})
    return UnfinishedMap(output, Faults(say, say))


def test_the_first_is_saved_at_once_and_others_when_due_or_asked_for(
    unfinished: UnfinishedMap, session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    unfinished.show(session, grid(0))
    assert shown_in(out) == 0
    unfinished.show(session, grid(100))
    assert shown_in(out) == 0
    unfinished.save()
    assert shown_in(out) == 100
    now = unfinished_map.time.monotonic()
    monkeypatch.setattr(unfinished_map.time, "monotonic", lambda: now + 1e4)
    unfinished.show(session, grid(0))
    assert shown_in(out) == 0


def test_it_is_a_run_that_says_it_is_not_finished(
    unfinished: UnfinishedMap, session: Session, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    for name in MAP_FILES:
        (out / name).write_text('{"command": "racecar live map"}')
    unfinished.show(session, grid(0))
    written = {"map.yaml", "map.pgm", "trajectory.tum", "session.npz", "report.json"}
    assert {path.name for path in out.iterdir()} == written
    report = read_report(out)
    assert report.quality.verdict == "doubtful"
    assert "not finished" in report.quality.reasons[0]
    assert load_session(out).is_of(load_tum(out / "trajectory.tum"))


def test_a_short_drive_does_not_replace_the_map_of_a_longer_one_before(
    unfinished: UnfinishedMap, session: Session, tmp_path: Path
) -> None:
    unfinished.leave_longer(len(session.keyframes))
    unfinished.show(session, grid(0))
    unfinished.save()
    assert not (tmp_path / "out").exists()


def test_a_finished_map_is_replaced_only_at_the_end(
    unfinished: UnfinishedMap, session: Session, tmp_path: Path
) -> None:
    unfinished.leave_finished()
    unfinished.show(session, grid(0))
    assert not (tmp_path / "out").exists()
    unfinished.save()
    assert shown_in(tmp_path / "out") == 0


def test_what_cannot_be_written_is_reported(session: Session, tmp_path: Path) -> None:
    said: list[str] = []
    (tmp_path / "out").write_text("a file")
    unfinished = UnfinishedMap(
        MapOutput(tmp_path / "out", Config(), {"live": True}), Faults(said.append, said.append)
    )
    unfinished.show(session, grid(0))
    assert "The map so far was not saved" in said[0]
