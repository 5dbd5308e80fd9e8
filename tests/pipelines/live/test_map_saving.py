"""The maps of live drives that were broken off, and of what follows."""

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.maps.sensing.measurement import Measurement
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.files.session_file import load_session
from racecar.pipelines.live.saving.map_saving import MapOutput, resume
from tests.mapping.worlds import ROOM, scan_at
from tests.maps.drives import drive, room

CONFIG = MappingConfig()


def laps(seconds: float = 40.0, seed: int = 0) -> Iterator[Measurement]:
    messages = drive(room(), seconds, np.random.default_rng(seed), odometry_scale=1.0).messages
    return (message for message in messages if isinstance(message, Odometry | Scan))


def mapped(messages: Iterator[Measurement]) -> Mapper:
    mapper = Mapper(CONFIG)
    for message in messages:
        feed(message, mapper)
    return mapper


def output(tmp_path: Path) -> MapOutput:
    return MapOutput(tmp_path / "out", CONFIG, {"live": True})


def test_a_later_drive_is_joined_where_it_is_recognized(tmp_path: Path) -> None:
    assert output(tmp_path).save([mapped(laps()), mapped(laps(seed=1))]) == []
    drives = load_session(tmp_path / "out").drives
    assert sorted(set(drives.tolist())) == [0, 1]
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_one_that_is_not_has_a_map_of_its_own_which_is_named(tmp_path: Path) -> None:
    elsewhere = (scan_at(ROOM, np.array([0.02 * k, 0.0, 0.0]), (k + 1) * 10**8) for k in range(60))
    (sentence,) = output(tmp_path).save([mapped(laps()), mapped(elsewhere)])
    assert "was not recognized on the earlier map" in sentence
    assert str(tmp_path / "out-2") in sentence
    assert set(load_session(tmp_path / "out").drives.tolist()) == {0}
    assert (tmp_path / "out-2" / "map.png").is_file()


def test_drives_that_were_set_aside_are_kept_in_their_order_until_all_is_over(tmp_path: Path) -> None:
    checkpoint = output(tmp_path).checkpoint()
    stamps = []
    for count in (300, 600):
        mapper = mapped(islice(laps(), count))
        stamps.append(mapper.last_stamp)
        checkpoint.save(mapper.to_arrays(), count)
        checkpoint.set_aside()
    assert [each.last_stamp for each in checkpoint.earlier(CONFIG)] == stamps
    said: list[str] = []
    checkpoint.save(mapper.to_arrays(), 600)
    assert resume(output(tmp_path), anew=False, announce=said.append).seconds_ago < 60.0
    assert len(checkpoint.earlier(CONFIG)) == 2
    checkpoint.remove()
    assert list(tmp_path.iterdir()) == []


def test_whoever_begins_anew_leaves_the_earlier_drives(tmp_path: Path) -> None:
    checkpoint = output(tmp_path).checkpoint()
    checkpoint.save(mapped(islice(laps(), 300)).to_arrays(), 300)
    checkpoint.set_aside()
    assert resume(output(tmp_path), anew=True, announce=pytest.fail).mapper.last_stamp is None
    assert checkpoint.earlier(CONFIG) == []
