"""The maps of live drives that were broken off, and of what follows."""

import json
import pickle
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.mapping.mapper import Mapper
from racecar.maps.errors import UserError
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.run_report import REPORT_FILE
from racecar.pipelines.files.session_file import load_session
from racecar.pipelines.live.saving.drive_log import AnotherDrive, DriveLog
from racecar.pipelines.live.saving.live_drive import LiveDrive
from racecar.pipelines.live.saving.map_saving import MapOutput, save_pickled
from racecar.pipelines.runs.output_places import OccupiedError
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.sensors.drives import drive, room
from tests.sensors.worlds import ROOM, scan_at

CONFIG = Config()


def laps(seconds: float = 40.0, seed: int = 0) -> Iterator[Measurement]:
    messages = drive(room(), seconds, np.random.default_rng(seed), odometry_scale=1.0).messages
    return (message for message in messages if isinstance(message, Odometry | Scan))


def mapped(messages: Iterator[Measurement]) -> Mapper:
    mapper = Mapper(CONFIG.mapping)
    for message in messages:
        feed(message, mapper)
    return mapper


def output(tmp_path: Path) -> MapOutput:
    return MapOutput(tmp_path / "out", CONFIG, {"live": True})


def test_a_later_drive_is_joined_where_it_is_recognized(tmp_path: Path) -> None:
    assert output(tmp_path).save([mapped(laps()), mapped(laps(seed=1))]) == []
    drives = load_session(tmp_path / "out").times.drives
    assert sorted(set(drives.tolist())) == [0, 1]
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_one_that_is_not_has_a_map_of_its_own_which_is_named(tmp_path: Path) -> None:
    elsewhere = (scan_at(ROOM, np.array([0.02 * k, 0.0, 0.0]), (k + 1) * 10**8) for k in range(60))
    (sentence,) = output(tmp_path).save([mapped(laps()), mapped(elsewhere)])
    assert "was not recognized on the earlier map" in sentence
    assert str(tmp_path / "out-2") in sentence
    assert set(load_session(tmp_path / "out").times.drives.tolist()) == {0}
    assert (tmp_path / "out-2" / "map.png").is_file()


@pytest.fixture(scope="module")
def earlier(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run."""
    folder = tmp_path_factory.mktemp("earlier")
    output(folder).save([mapped(laps())])
    return folder / "out"


@pytest.mark.parametrize("start", [{}, {"starts_at_first": True}, {"start": np.zeros(3)}])
def test_a_drive_extends_an_earlier_map_in_its_frame(
    earlier: Path, tmp_path: Path, start: dict[str, Any]
) -> None:
    known = load_session(earlier)
    extending = output(tmp_path).extending(earlier, **start)
    save_pickled(extending, pickle.dumps([mapped(islice(laps(seed=1), 600))]))
    found = load_session(tmp_path / "out")
    assert sorted(set(found.times.drives.tolist())) == [0, 1]
    moved = found.map_from_base[0] - known.map_from_base[0]
    assert np.abs(moved).max() < 0.05
    later = found.map_from_base[found.times.are_of_last]
    assert np.abs(later[0] - known.map_from_base[0]).max() < 0.1  # both laps start at one place
    assert json.loads((tmp_path / "out" / REPORT_FILE).read_text())["inputs"]["continue"] == str(earlier)


def test_a_drive_elsewhere_has_the_folder_to_itself(earlier: Path, tmp_path: Path) -> None:
    elsewhere = (scan_at(ROOM, np.array([0.02 * k, 0.0, 0.0]), (k + 1) * 10**8) for k in range(60))
    (sentence,) = output(tmp_path).extending(earlier).save([mapped(elsewhere)])
    assert "was not recognized on the earlier map" in sentence
    assert sentence.endswith(f"its map is in {tmp_path / 'out'}, in a frame of its own.")
    assert set(load_session(tmp_path / "out").times.drives.tolist()) == {0}


def test_no_map_is_replaced_while_it_is_extended(earlier: Path, tmp_path: Path) -> None:
    with pytest.raises(OccupiedError, match="name another folder with --out"):
        output(earlier.parent).extending(earlier)
    (tmp_path / "lab.posegraph").touch()
    with pytest.raises(UserError, match="is a pose graph of slam_toolbox, which only that can read"):
        output(tmp_path).extending(tmp_path / "lab")


def test_a_mapper_that_drives_on_is_saved_as_it_was(tmp_path: Path) -> None:
    mapper = mapped(islice(laps(), 600))
    save_pickled(output(tmp_path), pickle.dumps([mapper]))
    found = load_session(tmp_path / "out").map_from_keyframe
    assert np.array_equal(found, mapper.finish().session.map_from_keyframe)


def test_what_was_logged_is_mapped_again_drive_by_drive(tmp_path: Path) -> None:
    from racecar.pipelines.live.mapper_node import MapperNode
    from racecar.pipelines.live.ros.run import ros_node

    first, second = list(islice(laps(), 600)), list(islice(laps(seed=1), 300))
    log = DriveLog(tmp_path / "out")
    for entry in (*first, AnotherDrive(), *second):
        log.add(entry)
    again = DriveLog(tmp_path / "out")
    again.go_on(lambda sentence: None)
    with ros_node("test_logged", []) as node:
        live = LiveDrive(output(tmp_path), again)
        MapperNode(node, live)._map_logged()
    for mapper, messages in zip(live.mappers, (first, second), strict=True):
        before, after = mapped(iter(messages)).session(), mapper.session()
        assert np.array_equal(after.map_from_keyframe, before.map_from_keyframe)
