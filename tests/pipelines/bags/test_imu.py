"""IMUs in bags: which is read, about which axis, and in which order."""

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.bags.check import check_bag
from racecar.pipelines.bags.messages import IMU
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.writer import BagWriter
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate
from tests.pipelines.bag_samples import (
    PLACE,
    START,
    STEP,
    bag_of,
    numbers_of,
    odometry,
    write_links,
    write_scan,
)

PERIOD = 10_000_000


def write_imu(
    writer: BagWriter, stamp: int, rates=(0.1, 0.2, 0.3), frame="imu", topic="/imu", covariance=0.0
):
    message = writer._messages.imu(stamp, frame, 0.0)
    message.angular_velocity.x, message.angular_velocity.y, message.angular_velocity.z = map(float, rates)
    message.angular_velocity_covariance[0] = covariance
    writer.write_message(topic, IMU, message, stamp)


def drive(writer: BagWriter, count=80, *, has_odometry=True, **imu):
    """The IMU sends twice and a half as often as the laser."""
    writer.write_static_transform(PLACE)
    stamps = [(START + k * PERIOD, "imu") for k in range(count * STEP // PERIOD)]
    for stamp, kind in sorted([*stamps, *((START + k * STEP, k) for k in range(count))], key=lambda t: t[0]):
        if kind == "imu":
            write_imu(writer, stamp, **imu)
        else:
            if has_odometry:
                writer.write_odometry(odometry(kind))
            write_scan(writer, kind)


def contents(path, **options):
    with BagReader(path, **options) as reader:
        return list(reader), reader


@pytest.mark.parametrize("name", ["drive.bag", "drive"])
@pytest.mark.parametrize("has_odometry", [True, False])
def test_a_scan_follows_the_yaw_rates_that_cover_its_last_beam(tmp_path, name, has_odometry):
    path = bag_of(tmp_path / name, lambda writer: drive(writer, has_odometry=has_odometry))
    items, reader = contents(path)
    latest, late = {YawRate: 0, Odometry: 0 if has_odometry else 2**62}, 0
    for item in items:
        if isinstance(item, Scan):
            late += min(latest.values()) < item.stamp + round(item.time_offsets[-1] * 1e9)
        else:
            assert item.stamp >= latest[type(item)] or type(item) is Odometry
            latest[type(item)] = item.stamp
    assert late <= 1  # the last has nothing after it
    assert reader.counts["yaw_rates"] == 200
    assert reader.counts["scans"] == 80
    assert reader.messages_read == reader.message_count
    assert reader.imu_topic == reader.inputs["imu_topic"] == "/imu"
    assert {item.rate for item in items if isinstance(item, YawRate)} == {0.3}


def test_without_it_everything_is_as_in_a_bag_without_one(tmp_path):
    path = bag_of(tmp_path / "drive.bag", drive)
    with_imu, reader = contents(path)
    assert [type(item) for item in with_imu if not isinstance(item, YawRate)] == [
        type(item) for item in contents(path, use_imu=False)[0]
    ]
    _, reader = contents(path, use_imu=False)
    assert "imu_topic" not in reader.inputs
    assert "yaw_rates" not in reader.counts


def test_an_imu_that_stops_holds_no_scan_back_for_long(tmp_path):
    def write(writer):
        drive(writer, 20)
        for k in range(20, 80):
            writer.write_odometry(odometry(k))
            write_scan(writer, k)

    items, _ = contents(bag_of(tmp_path / "drive.bag", write))
    latest = 0
    for item in items:
        if isinstance(item, Scan):
            assert latest - item.stamp < 0.55e9
        latest = max(latest, item.stamp)
    assert sum(isinstance(item, Scan) for item in items) == 80


@pytest.mark.parametrize(
    ("roll", "pitch", "expected"),
    [
        (0.0, 0.0, 0.3),
        (np.pi, 0.0, -0.3),
        (np.pi / 2, 0.0, 0.2),
        (0.0, np.pi / 2, -0.1),
        (0.0, -np.pi / 2, 0.1),
    ],
)
def test_the_rate_is_about_the_axis_of_the_car_however_the_imu_is_mounted(tmp_path, roll, pitch, expected):
    def write(writer):
        drive(writer, 10)
        message = writer._messages.transform(START, "base_link", "imu", np.zeros(3)).transforms[0]
        half = np.array([roll, pitch]) / 2
        turned = message.transform.rotation
        turned.x, turned.y, turned.z = np.sin(half[0]), np.sin(half[1]), 0.0
        turned.w = np.cos(half[0]) * np.cos(half[1])
        whole = writer._messages.transform(START, "", "", np.zeros(3))
        whole.transforms[:] = [message]
        writer.write_message("/tf_static", "tf2_msgs/msg/TFMessage", whole, START + 10 * STEP)

    items, _ = contents(bag_of(tmp_path / "drive.bag", write))
    rates = [item.rate for item in items if isinstance(item, YawRate)]
    np.testing.assert_allclose(rates, expected, atol=1e-12)


def test_the_imu_of_a_camera_comes_last_and_another_may_be_named(tmp_path):
    def write(writer):
        drive(writer, 20)
        for k in range(500):
            write_imu(writer, START + k * 1_000_000, (0.0, 0.0, 7.0), topic="/camera/imu")

    path = bag_of(tmp_path / "drive.bag", write)
    assert contents(path)[1].imu_topic == "/imu"
    items, _ = contents(path, imu_topic="/camera/imu")
    assert {item.rate for item in items if isinstance(item, YawRate)} == {7.0}
    with pytest.raises(UserError, match="did you mean /imu"):
        contents(path, imu_topic="/imo")


@pytest.mark.parametrize(
    "broken", [{"rates": (0.0, 0.0, np.nan)}, {"rates": (np.inf, 0.0, 0.0)}, {"covariance": -1.0}]
)
def test_what_is_not_measured_is_left_out_and_counted(tmp_path, broken):
    items, reader = contents(bag_of(tmp_path / "drive.bag", lambda writer: drive(writer, 20, **broken)))
    assert not any(isinstance(item, YawRate) for item in items)
    assert reader.counts["invalid_yaw_rates"] == 50
    assert reader.counts["scans"] == 20


def test_a_dead_one_is_reported(tmp_path):
    def write(writer):
        drive(writer, 40, rates=(0.0, 0.0, 0.0))

    _, reader = contents(bag_of(tmp_path / "drive.bag", write))
    assert numbers_of("gyroscope_dead", reader)
    _, reader = contents(bag_of(tmp_path / "live.bag", drive_with_noise))
    assert reader.warnings == []


def drive_with_noise(writer):
    drive(writer, 40)
    write_imu(writer, START + 41 * STEP, (0.0, 0.0, 0.31))


def test_transforms_of_links_on_tf_count_too(tmp_path):
    def write(writer):
        drive(writer, 20)
        for k in range(20):
            write_links(writer, k, ("base_link", "imu", np.array([0.1, 0.0, 1.0])))

    items, _ = contents(bag_of(tmp_path / "drive.bag", write))
    assert {round(item.rate, 12) for item in items if isinstance(item, YawRate)} == {0.3}


def test_a_check_tells_of_it(tmp_path):
    with BagReader(bag_of(tmp_path / "drive.bag", drive_with_noise)) as reader:
        check = check_bag(reader)
    assert check.facts["imu"] == {
        "topic": "/imu",
        "count": 101,
        "rate_hz": 100.0,
        "fastest_turn_deg_s": pytest.approx(np.degrees(0.31), abs=0.1),
    }
    with BagReader(bag_of(tmp_path / "none.bag", drive), use_imu=False) as reader:
        assert check_bag(reader).facts["imu"] == {}


@pytest.mark.parametrize("rates", [(0.4, 0.0, 0.0), (0.0, -0.4, 0.0)])
def test_one_on_its_side_is_not_called_dead(tmp_path, rates):
    _, reader = contents(bag_of(tmp_path / "drive.bag", lambda writer: drive(writer, 40, rates=rates)))
    assert [each.name for each in reader.findings] == ["gyroscope_on_its_side"]
