"""Stamps of messages whose headers cannot be believed."""

from collections import Counter

import numpy as np
import pytest

from racecar.pipelines.bags.samples import Samples
from racecar.pipelines.bags.storage.chunks import BagTopic
from racecar.sensors.clocks.recorded_stamps import RecordedStamps
from racecar.sensors.clocks.topic_clock import SteadyClock
from tests.pipelines.bag_samples import PLACE, START, STEP, bag_of, odometry, read, write_scan

SECOND = 1_000_000_000
COUNT = 400
TRUE = [START + index * STEP for index in range(COUNT)]


def stamped(headers, recorded, **options):
    """The stamps of messages, in the order in which they were sent, and the counts that are not zero."""
    counts = Counter()
    clock = RecordedStamps(SteadyClock(offset=headers[0] - recorded[0]), counts, **options)
    stamps = {}
    for number, (header, at) in enumerate(zip(headers, recorded, strict=True)):
        stamps.update(clock.stamped(number, header, at))
    stamps.update(clock.rest())
    return [stamps[number] for number in range(len(headers))], +counts


@pytest.mark.parametrize(
    ("times", "offset"),
    [
        ([(10, 3), (20, 13), (99, 23)], 7),
        ([(0, 3), (0, 13)], None),
        ([(5, 3), (5, 13)], None),
        ([(-5, 3), (-6, 4)], None),
        ([], None),
    ],
)
def test_headers_are_ahead_of_the_recorder_by_the_usual_offset(times, offset):
    topic = BagTopic("/scan", "", "cdr", len(times))
    headers, recorded = [header for header, _ in times], [each for _, each in times]
    assert Samples(topic, recorded, headers, []).clock_offset == offset


@pytest.mark.parametrize("header", [0, 5_000])
def test_a_stamp_that_is_empty_or_absurd_is_that_of_recording(header):
    headers = [header if index == 50 else stamp + 100 for index, stamp in enumerate(TRUE)]
    stamps, counts = stamped(headers, TRUE)
    assert stamps == [stamp + 100 for stamp in TRUE]
    assert counts == {"stamps_from_recording_time": 1}


def test_what_is_right_stays_to_the_nanosecond_however_late_it_was_recorded():
    delays = np.random.default_rng(0).integers(0, 400_000_000, COUNT).tolist()
    stamps, counts = stamped(TRUE, [stamp + delay for stamp, delay in zip(TRUE, delays, strict=True)])
    assert stamps == TRUE
    assert counts == {}


@pytest.mark.parametrize(
    "jump", [-3600 * SECOND, -30 * SECOND, -3 * SECOND, 5 * SECOND, 7200 * SECOND, -START]
)
def test_a_clock_that_is_set_while_recording(jump):
    headers = [stamp + (jump if index >= 150 else 0) for index, stamp in enumerate(TRUE)]
    stamps, counts = stamped(headers, [stamp + 3_000_000 for stamp in TRUE])
    np.testing.assert_allclose(np.array(stamps) - START, np.array(TRUE) - START, atol=1_000_000)
    assert np.all(np.diff(stamps) > 0)
    assert counts == {"clock_jumps": 1}


@pytest.mark.parametrize("lost", [0, 3 * SECOND])
def test_stamps_that_stand_still_for_three_seconds(lost):
    """After that they show the time again, or go on from where they stood."""
    recorded = [stamp + 2_000_000 for stamp in TRUE]
    headers = [*TRUE[:100], *[TRUE[100]] * 120, *(stamp - lost for stamp in TRUE[220:])]
    stamps, counts = stamped(headers, recorded)
    np.testing.assert_allclose(np.array(stamps) - START, np.array(TRUE) - START, atol=3_000_000)
    assert 100 < counts["stamps_that_stood_still"] <= 123


def test_messages_that_the_recorder_kept_waiting_are_right():
    """It stood for five seconds, lost most of what came and wrote the rest at once."""
    kept = [*range(100), *range(100, 120), *range(300, COUNT)]
    headers = [TRUE[index] for index in kept]
    recorded = [TRUE[300] + index if 100 <= index < 120 else TRUE[index] + 1000 for index in kept]
    stamps, counts = stamped(headers, recorded)
    assert stamps == headers
    assert counts == {}


def test_what_is_sent_twice_bears_its_stamp_twice():
    headers = sorted([*TRUE, *TRUE[50:60]])
    stamps, counts = stamped(headers, [START + 20_000_000 * index for index in range(len(headers))])
    assert stamps == headers
    assert counts == {}


@pytest.mark.parametrize("topic", ["/scan", "/odom"])
@pytest.mark.parametrize("fault", ["frozen", "back", "zero"])
def test_a_bag_of_a_drive_with_such_a_clock(tmp_path, topic, fault):
    """Nothing is lost but a message or two, and all is where it was."""

    def header(index):
        if index < 150:
            return START + index * STEP
        if fault == "frozen":
            return START + (150 if index < 270 else index) * STEP
        return (START - 3600 * SECOND if fault == "back" else -149 * STEP) + index * STEP

    def write(writer):
        writer.write_static_transform(PLACE)
        original = writer.write_message

        def with_fault(name, message_type, message, at):
            if name == topic:
                stamp = header((at - START) // STEP)
                message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
            original(name, message_type, message, at)

        writer.write_message = with_fault
        for index in range(COUNT):
            writer.write_odometry(odometry(index))
            write_scan(writer, index)

    scans, samples, reader = read(bag_of(tmp_path / "drive.bag", write))
    taken = scans if topic == "/scan" else samples
    assert len(taken) >= COUNT - 2
    assert abs(taken[-1].stamp - TRUE[-1]) < 2_000_000
    names = {"frozen": "stamps_that_stood_still", "back": "clock_jumps", "zero": "clock_jumps"}
    assert names[fault] in {finding.name for finding in reader.findings}
    assert reader.counts.get("scans_without_odometry", 0) <= 2
