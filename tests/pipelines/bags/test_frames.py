"""Where lasers sit and what the car moves by, wherever a bag says it."""

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import inverse
from tests.pipelines.bag_samples import (
    PLACE,
    STEP,
    bag_of,
    numbers_of,
    odometry,
    read,
    write_links,
    write_scan,
)

MOUNT = ("base_link", "laser", PLACE)
COUNT = 60


def driven(index):
    return odometry(index).odom_from_base


def bag(path, links, *, with_odometry=False, count=COUNT, **options):
    """A bag whose every scan comes with the links of ``links(index)``."""

    def write(writer):
        for index in range(count):
            write_links(writer, index, *links(index), **options)
            if with_odometry:
                writer.write_odometry(odometry(index))
            write_scan(writer, index)

    return bag_of(path, write)


def assert_driven(samples, count=COUNT):
    assert len(samples) == count
    expected = [driven(index) for index in range(count)]
    np.testing.assert_allclose([sample.odom_from_base for sample in samples], expected, atol=1e-9)


@pytest.mark.parametrize("old", [False, True])
@pytest.mark.parametrize("name", ["drive.bag", "drive"])
@pytest.mark.parametrize("slash", ["", "/"])
def test_a_link_on_tf_that_never_changes_is_the_laser_s_place(tmp_path, name, old, slash):
    mount = (slash + "base_link", slash + "laser", PLACE)
    path = bag(tmp_path / name, lambda _: [mount], with_odometry=True, old=old)
    scans, samples, reader = read(path)
    np.testing.assert_allclose(scans[-1].base_from_laser, PLACE, atol=1e-9)
    assert (reader.base_from_laser_source, reader.odom_topic, reader.warnings) == ("tf", "/odom", [])
    assert len(samples) == COUNT


def on_tf(index):
    return ("odom", "base_link", driven(index))


NOWHERE, AHEAD = np.zeros(3), np.array([0.3, 0.0, 0.0])
GROUNDED = "a frame on the ground below the car that stands"
TREES = {
    "a link that moves": (lambda index: [on_tf(index), MOUNT], "odom -> base_link"),
    "corrections of a solution": (
        lambda index: [("map", "odom", np.array([1.0, index, 0.5])), on_tf(index), MOUNT],
        "odom -> base_link",
    ),
    GROUNDED: (
        lambda index: [
            ("odom", "base_footprint", NOWHERE),
            ("base_footprint", "base_link", driven(index)),
            MOUNT,
        ],
        "odom -> base_link",
    ),
    "a fixed frame between": (
        lambda index: [
            ("odom", "base_footprint", driven(index)),
            ("base_footprint", "base_link", NOWHERE),
            MOUNT,
        ],
        "odom -> base_footprint",
    ),
    "names of their own": (
        lambda index: [("start", "chassis", driven(index)), ("chassis", "laser", PLACE)],
        "start -> chassis",
    ),
    # a frame has one parent; so where another owns the base, odometry hangs below it
    "upside down": (lambda index: [("base_link", "odom", inverse(driven(index))), MOUNT], "odom"),
}
"""Links that come with each scan, and where in them the odometry is."""


@pytest.mark.parametrize("name", TREES)
def test_without_an_odometry_topic_the_moving_link_is_the_odometry(tmp_path, name):
    links, source = TREES[name]
    path = bag(tmp_path / "drive.bag", links)
    scans, samples, reader = read(path)
    assert_driven(samples)
    np.testing.assert_allclose(samples[-1].twist[0], 0.8, rtol=0.01)
    np.testing.assert_allclose(scans[-1].base_from_laser, PLACE, atol=1e-9)
    assert (len(scans), reader.odom_topic) == (COUNT, "/tf")
    assert source in reader.inputs["odometry"]
    assert reader.inputs["base_frame"] == ("chassis" if "chassis" in source else "base_link")
    stands = [each.numbers["link"] for each in reader.findings if each.name == "odometry_link_stands"]
    assert stands == ["odom -> base_footprint"] * (name == GROUNDED)
    assert len(reader.warnings) == len(stands)
    assert reader.messages_read == reader.message_count == 2 * COUNT
    assert read(path, use_odometry=False)[1] == []


def test_where_the_frames_are_apart_the_one_that_odometry_tells_of_is_the_car(tmp_path):
    def links(index):
        return [
            ("odom", "base_footprint", driven(index)),
            ("base_footprint", "base_link", AHEAD),
            ("base_link", "laser", AHEAD / 3.0),
        ]

    scans, samples, reader = read(bag(tmp_path / "drive.bag", links))
    assert_driven(samples)
    assert reader.inputs["base_frame"] == "base_footprint"
    np.testing.assert_allclose(scans[0].base_from_laser, [0.4, 0.0, 0.0], atol=1e-9)


def test_odometry_of_a_laser_that_nothing_links_to_the_car(tmp_path):
    _, samples, reader = read(bag(tmp_path / "drive.bag", lambda index: [on_tf(index)]))
    assert_driven(samples)
    assert reader.base_from_laser_source == "assumed identity"


@pytest.mark.parametrize(
    ("link", "finding"),
    [
        (lambda index: ("map", "base_link", driven(index)), ("no_odometry", "solution", "map -> base_link")),
        (lambda index: ("base_link", "wheel", driven(index)), None),  # a part that moves on the car
        (
            lambda index: ("odom", "base_link", NOWHERE),
            ("no_odometry_link_moves", "link", "odom -> base_link"),
        ),
    ],
    ids=["a solution", "a wheel", "a link that never changes"],
)
def test_what_is_on_tf_and_no_odometry_is_not_taken_for_it(tmp_path, link, finding):
    scans, samples, reader = read(bag(tmp_path / "drive.bag", lambda index: [link(index), MOUNT]))
    assert samples == []
    assert reader.base_from_laser_source == "tf"
    np.testing.assert_allclose(scans[0].base_from_laser, PLACE, atol=1e-9)
    if finding is not None:
        name, number, value = finding
        assert value in numbers_of(name, reader)[number]


@pytest.mark.parametrize("every", [1, 5])
def test_a_link_that_two_programs_publish_is_told_and_not_believed(tmp_path, every):
    other = np.array([1.0, 0.5, 0.2])

    def write(writer):
        for index in range(5 * COUNT):
            write_links(writer, index, ("odom", "base_link", driven(index)), MOUNT)
            if index % every == 0:
                write_links(writer, index, ("odom", "base_link", driven(index) + other))
            write_scan(writer, index)

    _, samples, reader = read(bag_of(tmp_path / "drive.bag", write))
    assert samples == []
    (finding,) = [each for each in reader.findings if each.name == "odometry_link_contested"]
    assert reader.tells_of_no_odometry
    assert finding.spoils_map


def test_an_odometry_topic_comes_before_a_link_that_never_changes(tmp_path):
    path = bag(
        tmp_path / "drive.bag", lambda _: [("odom", "base_link", np.zeros(3)), MOUNT], with_odometry=True
    )
    _, samples, reader = read(path)
    assert_driven(samples)
    assert (reader.odom_topic, reader.warnings) == ("/odom", [])


def test_a_link_that_moves_comes_before_a_topic_that_stands_still(tmp_path):
    def write(writer):
        for index in range(COUNT):
            writer.write_odometry(odometry(index, odom_from_base=np.zeros(3), twist=np.zeros(3)))
            write_links(writer, index, ("odom", "base_link", driven(index)), MOUNT)
            write_scan(writer, index)

    _, samples, reader = read(bag_of(tmp_path / "drive.bag", write))
    assert_driven(samples)
    assert numbers_of("odometry_topic_stands", reader)["topic"] == "/odom"
    assert len(read(reader.path, odom_topic="/odom")[1]) == COUNT


def test_the_odometry_on_tf_can_be_asked_for(tmp_path):
    path = bag(
        tmp_path / "drive.bag",
        lambda index: [("odom", "base_link", 2 * driven(index)), MOUNT],
        with_odometry=True,
    )
    _, samples, reader = read(path, odom_topic="/tf")
    assert reader.odom_topic == "/tf"
    np.testing.assert_allclose(samples[-1].odom_from_base, 2 * driven(COUNT - 1), atol=1e-9)
    nothing = bag(tmp_path / "other.bag", lambda _: [MOUNT], with_odometry=True)
    with pytest.raises(UserError, match="/tf holds no link that moves"):
        read(nothing, odom_topic="/tf")


def test_a_car_that_stands_for_minutes_before_it_drives(tmp_path):
    standing = 70_000_000_000 // STEP

    def write(writer):
        for index in range(0, standing, 8):
            write_links(writer, index, ("odom", "base_link", np.zeros(3)), MOUNT)
        for index in range(standing, standing + 600):
            write_links(writer, index, ("odom", "base_link", driven(index - standing)), MOUNT)
            write_scan(writer, index)

    _, samples, _ = read(bag_of(tmp_path / "drive.bag", write))
    assert_driven(samples[-600:], 600)


def test_a_link_that_is_repeated_with_one_stamp_counts_once(tmp_path):
    def write(writer):
        for index in range(COUNT):
            for _ in range(2):
                write_links(writer, index, ("odom", "base_link", driven(index)), MOUNT)
            write_scan(writer, index)

    _, samples, reader = read(bag_of(tmp_path / "drive.bag", write))
    assert_driven(samples)
    assert reader.warnings == []


@pytest.mark.parametrize("topic", ["/robot1/tf_static", "/tf_static", "/robot1/tf"])
def test_links_of_a_robot_in_a_namespace(tmp_path, topic):
    def write(writer):
        for index in range(COUNT):
            if index == 0 or not topic.endswith("static"):
                write_links(writer, index, ("robot1/base_link", "robot1/laser", PLACE), topic=topic)
            writer.write_odometry(
                odometry(index), "/robot1/odom", "robot1/odom", child_frame_id="robot1/base_link"
            )
            write_scan(writer, index, topic="/robot1/scan", frame_id="robot1/laser")

    scans, samples, reader = read(bag_of(tmp_path / "drive.bag", write))
    np.testing.assert_allclose(scans[0].base_from_laser, PLACE, atol=1e-9)
    assert (len(samples), reader.inputs["base_frame"], reader.warnings) == (COUNT, "robot1/base_link", [])


def test_the_links_and_wheels_of_another_robot_are_not_taken(tmp_path):
    def write(writer):
        for index in range(COUNT):
            for robot, place, speed in (("/a", PLACE, 1), ("/b", -PLACE, 3), ("/b", -PLACE, 3)):
                pose = speed * driven(index)
                write_links(
                    writer,
                    index,
                    ("odom", "base_link", pose),
                    ("base_link", "laser", place),
                    topic=robot + "/tf",
                )
            writer.write_odometry(odometry(index), "/b/odom")
            writer.write_odometry(odometry(index), "/a/odom")
            write_scan(writer, index, topic="/a/scan")

    path = bag_of(tmp_path / "drive.bag", write)
    scans, _, reader = read(path)
    np.testing.assert_allclose(scans[0].base_from_laser, PLACE, atol=1e-9)
    assert (reader.odom_topic, reader.warnings) == ("/a/odom", [])
    assert_driven(read(path, odom_topic="/a/tf")[1])


def test_tf_static_has_the_last_word_and_a_contradiction_is_told(tmp_path):
    def write(writer):
        writer.write_static_transform(PLACE)
        for index in range(COUNT):
            write_links(writer, index, ("base_link", "laser", PLACE + np.array([0.1, 0.0, 0.0])))
            writer.write_odometry(odometry(index))
            write_scan(writer, index)

    scans, _, reader = read(bag_of(tmp_path / "drive.bag", write))
    np.testing.assert_allclose(scans[0].base_from_laser, PLACE, atol=1e-9)
    assert reader.base_from_laser_source == "tf_static"
    assert numbers_of("place_told_twice", reader)


def test_a_base_that_only_the_tree_tells_is_told(tmp_path):
    path = bag(tmp_path / "drive.bag", lambda _: [("plate", "laser", PLACE)])
    scans, _, reader = read(path)
    np.testing.assert_allclose(scans[0].base_from_laser, PLACE, atol=1e-9)
    assert numbers_of("place_by_another_frame", reader)


PLACES = {"front": np.array([0.3, 0.0, 0.0]), "rear": np.array([-0.3, 0.0, np.pi])}
"""Of two lasers."""


def bag_of_two_lasers(path, topic):
    """Their scans on topics by their frames."""

    def write(writer):
        for frame, place in PLACES.items():
            write_links(writer, 0, ("base_link", frame, place), topic="/tf_static")
        for index in range(COUNT):
            writer.write_odometry(odometry(index))
            for frame in PLACES:
                write_scan(writer, index, frame_id=frame, topic=topic.format(frame))

    return bag_of(path, write)


def test_two_lasers_on_one_topic_have_a_place_each(tmp_path):
    scans, _, reader = read(bag_of_two_lasers(tmp_path / "drive.bag", "/scan"))
    assert len(scans) == 2 * COUNT
    assert [scan.laser for scan in scans[:4]] == [0, 1, 0, 1]
    for scan in scans:
        np.testing.assert_allclose(scan.base_from_laser, list(PLACES.values())[scan.laser], atol=1e-9)
    assert reader.warnings == []
    assert set(reader.inputs["lasers"]) == {"front", "rear"}


def test_two_lasers_on_two_topics(tmp_path):
    path = bag_of_two_lasers(tmp_path / "drive.bag", "/{}/scan")
    scans, _, reader = read(path, scan_topic=["/front/scan", "rear/scan"])
    assert (len(scans), reader.scan_topics) == (2 * COUNT, ["/front/scan", "/rear/scan"])
    assert {scan.laser for scan in scans} == {0, 1}
    assert reader.message_count == reader.messages_read == 3 * COUNT
    scans, _, reader = read(path)
    assert (len(scans), reader.scan_topics) == (COUNT, ["/front/scan"])
    assert numbers_of("laser_of_several", reader)
