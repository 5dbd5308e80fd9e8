"""Where the sensor sits."""

from types import SimpleNamespace as Some

import numpy as np
import pytest

from racecar.pipelines.bags.converters.transforms import SensorPlace, TransformTree


def transform(parent, child, translation, rotation):
    x, y, z = translation
    a, b, c, w = rotation
    return Some(
        header=Some(frame_id=parent),
        child_frame_id=child,
        transform=Some(translation=Some(x=x, y=y, z=z), rotation=Some(x=a, y=b, z=c, w=w)),
    )


HALF = np.sqrt(0.5)


def test_a_chain_of_links_is_followed_both_ways():
    tree = TransformTree()
    tree.add(transform("/base_link", "/deck", (0.1, 0.0, 0.2), (0, 0, HALF, HALF)))
    tree.add(transform("laser", "deck", (-0.3, 0.0, 0.0), (0, 0, 0, 1)))
    place = SensorPlace(tree.between("base_link", "laser"), "tf_static")
    np.testing.assert_allclose(place.pose, [0.1, 0.3, np.pi / 2], atol=1e-12)
    assert not place.is_upside_down
    assert tree.between("base_link", "camera") is None


@pytest.mark.parametrize(
    ("rotation", "yaw", "tilt", "is_upside_down"),
    [
        ((1, 0, 0, 0), 0.0, 0.0, True),
        ((0, 1, 0, 0), np.pi, 0.0, True),
        ((0, np.sin(0.1), 0, np.cos(0.1)), 0.0, 0.2, False),
    ],
)
def test_a_sensor_upside_down_or_tilted(rotation, yaw, tilt, is_upside_down):
    tree = TransformTree()
    tree.add(transform("base_link", "laser", (0, 0, 0), rotation))
    place = SensorPlace(tree.between("base_link", "laser"), "tf_static")
    assert place.is_upside_down == is_upside_down
    np.testing.assert_allclose(abs(place.pose[2]), yaw, atol=1e-12)
    assert place.tilt == pytest.approx(tilt, abs=1e-6)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("translation", "rotation"),
    [
        ((1, 0, 0), (0, 0, 0, 0)),
        *(((0, value, 0), (0, 0, 0, 1)) for value in (np.nan, np.inf, 1e300)),
        *(((0, 0, 0), (0, 0, value, 1)) for value in (np.nan, np.inf, 1e200)),
    ],
)
def test_a_rotation_of_zero_and_damaged_bytes_are_no_link(translation, rotation):
    tree = TransformTree()
    tree.add(transform("base_link", "laser", translation, rotation))
    assert tree.between("base_link", "laser") is None


def test_a_pose_as_a_place():
    pose = np.array([1.0, -2.0, 2.5])
    np.testing.assert_allclose(SensorPlace.from_pose(pose, "given").pose, pose)
