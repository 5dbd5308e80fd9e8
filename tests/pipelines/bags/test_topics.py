"""Which of several topics are taken."""

import numpy as np
import pytest

from tests.pipelines.bag_samples import (
    BEAMS,
    INCREMENT,
    PLACE,
    bag_of,
    numbers_of,
    odometry,
    read,
    write_scan,
)

COUNT = 30


def bag(path, *topics):
    """A bag of scans: topic, how many, and what else is particular about them."""

    def write(writer):
        writer.write_static_transform(PLACE)
        for index in range(4 * COUNT):
            for topic, count, changes in topics:
                if index < count:
                    ranges = changes.get("ranges", np.full(BEAMS, 2.0, dtype=np.float32)) + np.float32(
                        1e-3 * index
                    )
                    write_scan(writer, index, topic=topic, **{**changes, "ranges": ranges})
            writer.write_odometry(odometry(index))

    return bag_of(path, write)


NARROW = {"ranges": np.full(61, 2.0, dtype=np.float32), "angle_min": -np.radians(30)}
WIDE = {
    "ranges": np.linspace(2.0, 3.0, 361, dtype=np.float32),
    "angle_min": -np.pi,
    "angle_increment": np.radians(1.0),
}
BLIND = {"ranges": np.full(361, np.inf, dtype=np.float32), "angle_min": -np.pi, "angle_increment": INCREMENT}


@pytest.mark.parametrize(
    ("others", "taken"),
    [
        ([("/camera/scan", 4 * COUNT, NARROW), ("/scan", COUNT, {})], "/scan"),
        ([("/front_sensor", 4 * COUNT, NARROW), ("/base", COUNT, {})], "/base"),
        ([("/stable_scan", COUNT + 1, {}), ("/scan", COUNT, {})], "/scan"),
        ([("/scan_filtered", COUNT + 1, {}), ("/base_scan", COUNT, {})], "/base_scan"),
        ([("/scan", COUNT, {}), ("/scan_raw", COUNT, {})], "/scan_raw"),
        ([("/front/scan", COUNT, {}), ("/top/scan", COUNT, WIDE)], "/top/scan"),
        ([("/scan", COUNT, BLIND), ("/other", COUNT, {})], "/other"),
        ([("/scan", 2, {}), ("/laser_1", 2 * COUNT, {})], "/laser_1"),
        ([("/scan", COUNT, {}), ("/scan_multi", 2 * COUNT, WIDE)], "/scan"),
    ],
)
def test_the_raw_scans_that_see_widest_are_taken_and_the_others_named(tmp_path, others, taken):
    path = bag(tmp_path / "drive.bag", *others)
    _, _, reader = read(path)
    assert reader.scan_topic == taken
    (finding,) = reader.findings
    assert finding.name == "laser_of_several" and finding.numbers["taken"].startswith(f"{taken} (")
    assert all(topic in finding.numbers["others"] for topic, _, _ in others if topic != taken)


def test_a_processed_topic_alone_is_taken_without_a_word(tmp_path):
    _, _, reader = read(bag(tmp_path / "drive.bag", ("/merged_scan", COUNT, {})))
    assert (reader.scan_topic, reader.warnings) == ("/merged_scan", [])


def test_wheels_come_before_cameras(tmp_path):
    def write(writer):
        for index in range(COUNT):
            for step in range(4):
                writer.write_odometry(odometry(4 * index + step), "/camera/odom/sample")
            writer.write_odometry(odometry(4 * index), "/wheel_odom")
            write_scan(writer, 4 * index)

    _, _, reader = read(bag_of(tmp_path / "drive.bag", write))
    assert reader.odom_topic == "/wheel_odom"
    assert numbers_of("odometry_topic_of_several", reader)["others"] == "/camera/odom/sample"


def opened_recording(recordings, name):
    from racecar.pipelines.bags.reader import BagReader

    path = recordings / "strangers" / name / f"{name}.bag"
    if not path.exists():
        pytest.skip(f"no {path}")
    return BagReader(path)


@pytest.mark.parametrize("name", ["neato_processed_scan", "neato_laser_in_tf", "neato_square"])
def test_recordings_with_processed_copies(recordings, name):
    with opened_recording(recordings, name) as reader:
        assert reader.scan_topic == "/scan"
        assert reader.base_from_laser_source == "tf"
        np.testing.assert_allclose(np.cos(reader.base_from_laser[2]), -1.0, atol=1e-6)


@pytest.mark.parametrize("name", ["mower_rplidar", "amr_merged_scan"])
def test_recordings_with_odometry_on_tf_only(recordings, name):
    with opened_recording(recordings, name) as reader:
        assert reader.odom_topic == "/tf"
        assert "odom -> base_link" in reader.odometry_source
