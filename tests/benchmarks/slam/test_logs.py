from pathlib import Path

import pytest

from benchmarks.slam.logs import find_logs
from racecar.maps.errors import UserError


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    home = tmp_path / "slam_benchmark"
    (home / "of_ros2").mkdir(parents=True)
    for name in ("a.bag", "b.mcap", "c.db3", "without_relations.bag"):
        (home / name).touch()
    for name in ("a", "b", "c", "of_ros2", "without_bag"):
        (home / f"{name}.relations").touch()
    return tmp_path


def test_every_bag_with_relations_is_a_log(folder: Path) -> None:
    logs = find_logs(folder)
    home = folder / "slam_benchmark"
    assert [(log.name, log.bag.name) for log in logs] == [
        ("a", "a.bag"),
        ("b", "b.mcap"),
        ("c", "c.db3"),
        ("of_ros2", "of_ros2"),
    ]
    assert all(log.relations == home / f"{log.name}.relations" for log in logs)
    assert find_logs(home) == logs


def test_only_the_logs_that_are_named(folder: Path) -> None:
    assert [log.name for log in find_logs(folder, ["c", "a"])] == ["a", "c"]
    with pytest.raises(UserError, match=r"no log 'd' in .*; there are: a, b, c, of_ros2"):
        find_logs(folder, ["a", "d"])


def test_no_log_at_all(tmp_path: Path) -> None:
    (tmp_path / "a.bag").touch()
    with pytest.raises(UserError, match=r"no benchmark log in .*--data"):
        find_logs(tmp_path)
    with pytest.raises(UserError, match="no benchmark log"):
        find_logs(tmp_path / "nowhere")
