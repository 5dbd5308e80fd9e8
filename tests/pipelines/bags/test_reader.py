"""Whole bags: what comes out of them, and in what order."""

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.bags.messages import LASER_SCAN
from racecar.pipelines.bags.reader import BagReader
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.pipelines.bag_samples import (
    BEAMS,
    PLACE,
    START,
    STEP,
    as_sqlite,
    bag_of,
    numbers_of,
    odometry,
    read,
    write_bag,
    write_scan,
)


@pytest.fixture(params=["ros1", "mcap", "lone mcap", "sqlite", "lone db3", "no metadata"])
def bag(request, tmp_path):
    if request.param == "ros1":
        return write_bag(tmp_path / "drive.bag")
    folder = write_bag(tmp_path / "drive")
    if request.param in ("sqlite", "lone db3"):
        folder = as_sqlite(folder, tmp_path / "other")
    if request.param == "no metadata":
        (folder / "metadata.yaml").unlink()
    if request.param.startswith("lone"):
        return next(file for file in folder.iterdir() if file.suffix in (".mcap", ".db3"))
    return folder


def test_every_kind_of_bag_gives_what_was_written(bag):
    scans, samples, reader = read(bag)
    assert (len(scans), len(samples)) == (200, 200)
    assert reader.messages_read == reader.message_count == 400
    assert (reader.scan_topic, reader.odom_topic) == ("/scan", "/odom")
    assert [scan.stamp for scan in scans] == [START + index * STEP for index in range(200)]
    np.testing.assert_allclose(scans[7].ranges, np.float32(2.007))
    np.testing.assert_allclose(scans[7].bearings, np.radians(np.arange(BEAMS) - 90), atol=1e-6)
    np.testing.assert_allclose(scans[7].time_offsets, 1e-4 * np.arange(BEAMS), rtol=1e-6)
    np.testing.assert_allclose(samples[9].odom_from_base, odometry(9).odom_from_base, atol=1e-12)
    np.testing.assert_allclose(samples[9].twist, odometry(9).twist)
    assert reader.base_from_laser_source == "tf_static"
    np.testing.assert_allclose(scans[0].base_from_laser, PLACE, atol=1e-12)
    assert reader.warnings == []


def test_a_scan_follows_the_odometry_that_covers_its_last_beam(tmp_path):
    with BagReader(write_bag(tmp_path / "drive.bag")) as reader:
        latest = 0
        for item in reader:
            if isinstance(item, Odometry):
                latest = item.stamp
            elif item.stamp < START + 199 * STEP:
                assert item.stamp + item.time_offsets[-1] * 1e9 <= latest < item.stamp + 2 * STEP


def test_odometry_that_stops_holds_scans_up_for_half_a_second_at_most(tmp_path):
    path = write_bag(tmp_path / "drive.bag", place=None, wheels=lambda index: {} if index < 50 else None)
    scans, _, reader = read(path)
    assert len(scans) == 200
    assert reader.counts["scans_without_odometry"] == 151
    assert numbers_of("scans_without_odometry", reader)


def test_reading_twice_gives_the_same(tmp_path):
    with BagReader(write_bag(tmp_path / "drive")) as reader:
        first = [item.stamp for item in reader]
        counts = reader.counts
        assert [item.stamp for item in reader] == first
        assert reader.counts == counts


def test_without_odometry(tmp_path):
    scans, samples, reader = read(write_bag(tmp_path / "drive.bag", with_odometry=False))
    assert (len(scans), len(samples), reader.odom_topic) == (200, 0, None)
    assert numbers_of("no_odometry", reader)


def test_odometry_left_aside(tmp_path):
    scans, samples, reader = read(write_bag(tmp_path / "drive.bag"), use_odometry=False)
    assert (len(scans), len(samples), reader.warnings) == (200, 0, [])


def test_the_flag_overrides_the_transform(tmp_path):
    place = np.array([1.0, 2.0, 3.0])
    scans, _, reader = read(write_bag(tmp_path / "drive.bag"), laser_pose=place)
    assert reader.base_from_laser_source == "given"
    np.testing.assert_allclose(scans[0].base_from_laser, place)


def test_without_a_transform_the_place_is_assumed_and_said_so(tmp_path):
    scans, _, reader = read(write_bag(tmp_path / "drive.bag", 3, with_odometry=False, place=None))
    assert reader.base_from_laser_source == "assumed identity"
    np.testing.assert_array_equal(scans[0].base_from_laser, np.zeros(3))
    assert numbers_of("place_unknown", reader)["sensor"] == "laser"


@pytest.mark.parametrize(
    ("topic", "complaint"),
    [
        ("/scam", r"/scam.*did you mean /scan\?.*/odom"),
        ("/odom", r"/odom holds nav_msgs/msg/Odometry.*: /scan"),
    ],
)
def test_a_topic_without_scans_is_refused(tmp_path, topic, complaint):
    with pytest.raises(UserError, match=complaint):
        BagReader(write_bag(tmp_path / "drive.bag"), scan_topic=topic)


def test_of_several_topics_the_fullest_is_taken_but_never_the_truth(tmp_path):
    def write(writer):
        for index in range(20):
            writer.write_odometry(odometry(2 * index), topic="/ground_truth")
            writer.write_odometry(odometry(2 * index + 1), topic="/ground_truth")
            writer.write_odometry(odometry(index), topic="/wheels")
            write_scan(writer, index)
            if index < 5:
                write_scan(writer, index, topic="/rear")

    _, samples, reader = read(bag_of(tmp_path / "drive.bag", write))
    assert (reader.scan_topic, reader.odom_topic, len(samples)) == ("/scan", "/wheels", 20)
    (finding,) = (each for each in reader.findings if each.name != "place_unknown")
    assert finding.name == "laser_of_several"
    assert finding.numbers["taken"].startswith("/scan ") and "/rear" in finding.numbers["others"]
    _, samples, reader = read(reader.path, odom_topic="ground_truth", scan_topic="/rear")
    assert (reader.scan_topic, reader.odom_topic) == ("/rear", "/ground_truth")


def test_a_guess_between_wheels_is_told_with_the_flag_that_mends_it(tmp_path):
    def write(writer):
        for index in range(20):
            writer.write_odometry(odometry(index), topic="/odom")
            writer.write_odometry(odometry(index), topic="/vesc/odom")
            write_scan(writer, index)

    _, _, reader = read(bag_of(tmp_path / "drive.bag", write))
    assert reader.odom_topic == "/odom"
    assert numbers_of("odometry_topic_of_several", reader) == {"taken": "/odom", "others": "/vesc/odom"}


def test_a_bag_without_scans_names_its_topics(tmp_path):
    path = bag_of(tmp_path / "drive.bag", lambda writer: writer.write_odometry(odometry(0)))
    with pytest.raises(UserError, match=r"no laser scans.*/odom"):
        BagReader(path)


def test_scans_out_of_order_are_sorted_and_late_ones_dropped_and_counted(tmp_path):
    order = list(range(200))
    order[20], order[30] = order[30], order[20]
    order.insert(150, 10)
    order.insert(90, 90)

    def write(writer):
        for index in order:
            message = _scan_message(writer, index)
            writer.write_message("/scan", LASER_SCAN, message, START + STEP * len(written))
            written.append(index)

    written: list[int] = []
    scans, _, reader = read(bag_of(tmp_path / "drive.bag", write))
    assert [scan.stamp for scan in scans] == [START + index * STEP for index in range(200)]
    assert reader.counts["dropped_out_of_order"] == 1
    assert reader.counts["dropped_duplicates"] == 1


def test_one_stamp_far_ahead_does_not_cost_the_rest_of_the_log(tmp_path):
    def write(writer):
        for index in range(200):
            ahead = 1_800_000_000_000 if index == 50 else 0
            message = _scan_message(writer, index)
            message.header.stamp.sec += ahead // 1_000_000_000
            writer.write_message("/scan", LASER_SCAN, message, START + index * STEP)

    scans, _, reader = read(bag_of(tmp_path / "drive.bag", write))
    assert len(scans) == 199
    assert reader.counts["dropped_out_of_order"] == 1


@pytest.mark.parametrize("header", [0, 77_000_000_000])
def test_without_stamps_the_time_of_recording_stands_in(tmp_path, header):
    def write(writer):
        for index in range(50):
            writer.write_odometry(odometry(index))
            message = _scan_message(writer, index)
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(header, 1_000_000_000)
            writer.write_message("/scan", LASER_SCAN, message, START + index * STEP)

    scans, _, reader = read(bag_of(tmp_path / "drive.bag", write))
    assert [scan.stamp for scan in scans] == [START + index * STEP for index in range(50)]
    assert reader.counts["stamps_from_recording_time"] == 50


def test_a_constant_difference_to_the_recorder_s_clock_is_no_fault(tmp_path):
    def write(writer):
        for index in range(50):
            message = _scan_message(writer, index)
            writer.write_message("/scan", LASER_SCAN, message, START + index * STEP - 10**17)

    scans, _, reader = read(bag_of(tmp_path / "drive.bag", write))
    assert scans[-1].stamp == START + 49 * STEP
    assert "stamps_from_recording_time" not in reader.counts


def test_a_gap_is_told(tmp_path):
    scans, _, reader = read(write_bag(tmp_path / "drive.bag", [0, *range(12_000, 12_100)], place=None))
    assert len(scans) == 101
    assert reader.counts["gaps"] == 1
    assert numbers_of("scan_gaps", reader)["gaps"] == "a gap of 300 s after scan 1"


def test_the_reader_holds_a_bounded_part_of_the_bag(tmp_path):
    import tracemalloc

    def peak(count):
        path = write_bag(tmp_path / f"{count}.bag", count)
        tracemalloc.start()
        read_through(path)
        size = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return size, path.stat().st_size

    def read_through(path):
        with BagReader(path) as reader:
            assert sum(isinstance(item, Scan) for item in reader) > 0

    read_through(write_bag(tmp_path / "first.bag", 10))  # imports, and caches of types
    (small, of_small), (large, of_large) = peak(2_000), peak(8_000)
    assert large - small < 0.1 * (of_large - of_small)


def _scan_message(writer, index):
    """A scan that bears its index's stamp, whenever it is recorded."""
    kept = {}
    original, writer.write_message = (
        writer.write_message,
        lambda *arguments: kept.update(message=arguments[2]),
    )
    write_scan(writer, index)
    writer.write_message = original
    return kept["message"]


@pytest.mark.parametrize(
    ("name", "scan_count", "odometry_count", "beams"),
    [
        ("slam_benchmark/intel.bag", 13631, 13631, {180}),
        ("slam_benchmark/fr079", 4934, 4934, {360}),
        ("slam_benchmark/aces", 7374, 7374, {180}),
        ("racecar/session_A", 1877, 2435, {1081}),
        ("racecar/localization_bag1.bag", 281, 350, {1081}),
        ("cartographer_runs/glc_ot_ez", 814, 1136, None),
        ("cartographer_runs/hangar_pus_30_v1", 1109, 2745, None),
    ],
)
def test_real_recordings(recordings, name, scan_count, odometry_count, beams):
    seen, scans, samples, last = set(), 0, 0, 0
    with BagReader(recordings / name) as reader:
        for item in reader:
            if isinstance(item, Scan):
                assert item.stamp > last
                assert (np.diff(item.bearings) > 0).all()
                last, scans = item.stamp, scans + 1
                seen.add(len(item.ranges))
                assert not (item.ranges[item.is_return] >= item.max_range).any()
            else:
                samples += 1
    assert (scans, samples) == (scan_count, odometry_count)
    assert beams is None or seen == beams
    assert reader.messages_read == reader.message_count
