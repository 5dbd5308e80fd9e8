"""Where a laser sits, by transforms that contradict each other or are changed."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.bags.car_frames import CarFrames
from racecar.pipelines.bags.converters.transforms import FrameLinks, SensorPlace

RIGHT, WRONG = np.array([0.3, 0.0, 0.0]), np.array([1.6, 0.0, 0.0])


def transforms(*links: tuple[str, str, Pose]) -> Any:
    return SimpleNamespace(transforms=[transform(*link) for link in links])


def transform(parent: str, child: str, pose: Pose) -> Any:
    half = pose[2] / 2
    return SimpleNamespace(
        header=SimpleNamespace(frame_id=parent, stamp=SimpleNamespace(sec=0, nanosec=0)),
        child_frame_id=child,
        transform=SimpleNamespace(
            translation=SimpleNamespace(x=float(pose[0]), y=float(pose[1]), z=0.0),
            rotation=SimpleNamespace(x=0.0, y=0.0, z=float(np.sin(half)), w=float(np.cos(half))),
        ),
    )


def placed(frames: CarFrames) -> SensorPlace:
    found = frames.placed("laser")
    assert found.base_frame
    return found


def test_of_links_in_a_circle_the_first_counts_and_the_other_is_told() -> None:
    frames = CarFrames(links=FrameLinks(takes_mended=True))
    frames.take(transforms(("base_link", "laser", RIGHT)), "/tf_static")
    assert placed(frames).findings == ()
    frames.take(transforms(("laser", "base_link", -WRONG)), "/tf_static")
    np.testing.assert_allclose(placed(frames).pose, RIGHT, atol=1e-9)
    (finding,) = placed(frames).findings
    assert "in a circle: by laser -> base_link laser sits at x 1.60 m" in finding.what
    assert "by the others at x 0.30 m" in finding.what


def test_a_longer_way_round_is_told_too() -> None:
    frames = CarFrames(links=FrameLinks(takes_mended=True))
    frames.take(transforms(("base_link", "laser", RIGHT), ("base_link", "plate", RIGHT)), "/tf_static")
    frames.take(transforms(("plate", "laser", RIGHT), ("plate", "camera", WRONG)), "/tf_static")
    np.testing.assert_allclose(placed(frames).pose, RIGHT, atol=1e-9)
    (finding,) = placed(frames).findings
    assert "by plate -> laser laser sits at x 0.60 m" in finding.what


def test_links_that_agree_all_round_are_no_matter() -> None:
    frames = CarFrames(links=FrameLinks(takes_mended=True))
    frames.take(transforms(("base_link", "laser", RIGHT), ("laser", "base_link", -RIGHT)), "/tf_static")
    assert placed(frames).findings == ()


def test_a_link_that_is_put_right_counts_from_then_on() -> None:
    for topic in ("/tf_static", "/tf"):
        frames = CarFrames(links=FrameLinks(takes_mended=True))
        for pose in (WRONG, WRONG, RIGHT, RIGHT):
            before = frames.version
            frames.take(transforms(("base_link", "laser", pose)), topic)
        np.testing.assert_allclose(placed(frames).pose, RIGHT, atol=1e-9)
        assert frames.version == before or topic == "/tf_static"


def test_a_link_that_changes_all_the_time_tells_no_place() -> None:
    frames = CarFrames(links=FrameLinks(takes_mended=True))
    for number in range(10):
        frames.take(transforms(("base_link", "laser", 0.1 * number * RIGHT)), "/tf")
    assert not frames.placed("laser").is_sure
