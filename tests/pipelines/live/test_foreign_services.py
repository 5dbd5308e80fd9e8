"""Services under the names and types of AMCL, nav2 and slam_toolbox, where these are installed."""

import pickle
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from racecar.maps.map_files import load_map
from racecar.pipelines.files.session_file import load_session
from tests.pipelines.live.foreign_services import install, service
from tests.pipelines.live.live_car import recorded
from tests.pipelines.live.stage import Stage, car_stage, initial_pose


@pytest.fixture(scope="module")
def mapped(folder: Path) -> Iterator[Stage]:
    """A mapper that has driven for some seconds, and saves in this process."""
    from racecar.pipelines.live.saving import map_saving

    with pytest.MonkeyPatch.context() as patch, car_stage() as stage:
        install(patch, "nav2_msgs", SaveMap=service(result=False))
        install(
            patch,
            "slam_toolbox",
            SaveMap=service(result=1),
            SerializePoseGraph=service(result=1),
            DeserializePoseGraph=service(result=1),
        )
        patch.setattr(map_saving, "in_fresh_process", lambda work, **_: pickle.loads(pickle.dumps(work))())
        stage.map(folder / "out")
        stage.car.drive()
        stage.await_right(6.0)
        yield stage


def test_amcls_services_are_served(tmp_path: Path) -> None:
    from std_srvs.srv import Empty

    with pytest.MonkeyPatch.context() as patch, car_stage() as stage:
        install(patch, "nav2_msgs", SetInitialPose=service())
        stage.localize(tmp_path, initial_pose=recorded()[0][2])
        stage.car.drive()
        stage.await_right()
        stage.bus.call("/set_initial_pose", SimpleNamespace(pose=initial_pose(np.array([500.0, 0.0, 0.0]))))
        stage.await_diagnosis("is not on the map's free space")
        stage.bus.call("/set_initial_pose", SimpleNamespace(pose=initial_pose(stage.car.place)))
        stage.bus.call("/request_nomotion_update", Empty.Request())
        stage.await_words("Searching for the car near", "scans count while the car stands, too")
        stage.await_right()


def test_without_their_packages_there_are_none(tmp_path: Path) -> None:
    with car_stage() as stage:
        stage.map(tmp_path / "out")
        services = stage.bus.services
        assert "/save_map" in services
        assert not [name for name in services if "slam_toolbox" in name or "map_saver" in name]


def test_slam_toolbox_saves_by_name(mapped: Stage, folder: Path) -> None:
    request = SimpleNamespace(name=SimpleNamespace(data=str(folder / "maps" / "lab")))
    assert mapped.bus.call("/slam_toolbox/save_map", request).result == 0
    copy = load_map(folder / "maps" / "lab.yaml")
    assert np.array_equal(copy.cells, load_map(folder / "out").cells)


def test_nav2_saves_by_url_and_only_this_nodes_map(mapped: Stage, folder: Path) -> None:
    request = SimpleNamespace(map_topic="map", map_url=f"file://{folder}/by_url.yaml")
    assert mapped.bus.call("/map_saver/save_map", request).result
    assert load_map(folder / "by_url.yaml").cells.size > 1000
    for topic, url in (("", "package://maps/floor.yaml"), ("costmap", "x")):
        request = SimpleNamespace(map_topic=topic, map_url=url)
        assert not mapped.bus.call("/map_saver/save_map", request).result
    mapped.await_words("package://maps/floor.yaml is not the name of a file")


def test_serialized_maps_can_be_extended(mapped: Stage, folder: Path) -> None:
    request = SimpleNamespace(filename=str(folder / "serialized"))
    assert mapped.bus.call("/slam_toolbox/serialize_map", request).result == 0
    assert (folder / "serialized" / "session.npz").is_file()


def test_a_drive_extends_a_map_that_is_deserialized(mapped: Stage, folder: Path) -> None:
    def save(name: str) -> None:
        request = SimpleNamespace(filename=str(folder / name))
        assert mapped.bus.call("/slam_toolbox/serialize_map", request).result == 0

    time.sleep(20.0)  # a few metres could be anywhere
    save("first")
    x, y, theta = mapped.poses[-1].pose.tolist()
    request = SimpleNamespace(
        filename=str(folder / "first"), match_type=2, initial_pose=SimpleNamespace(x=x, y=y, theta=theta)
    )
    assert mapped.bus.call("/slam_toolbox/deserialize_map", request).result == 0
    mapped.await_words(f"The drive extends the map in {folder / 'first'} when it is saved")
    save("both")
    both = load_session(folder / "both")
    assert set(both.times.drives.tolist()) == {0, 1}
    begins = both.map_from_base[both.times.are_of_last][0]
    assert np.abs(begins - both.map_from_base[0]).max() < 0.05


def test_what_cannot_be_deserialized_is_named(mapped: Stage, folder: Path) -> None:
    for filename, kind, words in (
        (str(folder), 1, "there is no map to extend"),
        (str(folder / "out"), 1, "name another folder with --out"),
        (str(folder / "first"), 3, "`racecar live localize --map"),
        ("", 1, "filename names no folder"),
    ):
        request = SimpleNamespace(filename=filename, match_type=kind, initial_pose=None)
        assert mapped.bus.call("/slam_toolbox/deserialize_map", request).result == 255
        mapped.await_diagnosis(words)
