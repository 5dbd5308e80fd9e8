"""Files that claim to hold more than they do."""

import time

from racecar.pipelines.bags.storage import chunks
from racecar.pipelines.bags.storage.chunks import BagTopic, Chunk, ChunkedFile
from racecar.pipelines.bags.storage.compression import Allowance, decompress_what_is_there, zstd
from racecar.pipelines.bags.storage.mcap import MAGIC, McapFile, _chunk_head, _record_head
from racecar.pipelines.bags.storage.ros1 import Ros1File
from tests.pipelines.bag_samples import numbers_of, read, write_bag

TOPIC = BagTopic("/scan", "sensor_msgs/msg/LaserScan", "cdr")


def test_blocks_give_together_no_more_than_a_file_of_their_size_may_hold():
    block = zstd.compress(bytes(8 << 20))
    allowance = Allowance(20 * len(block))
    given = [len(decompress_what_is_there(block, "zstd", allowance)) for _ in range(20)]
    assert given[0] == 8 << 20
    assert sum(given) <= (16 << 20) + 200 * 20 * len(block)
    assert given[-1] == 0


def test_what_looks_like_the_fields_of_chunks_is_passed_over_once(tmp_path):
    path = tmp_path / "drive.bag"
    path.write_bytes(b"#ROSBAG V2.0\n" + b"\xff" * 50 + b"\x04\0\0\0op=\x05\0\0\x10\0" * 100_000)
    began = time.monotonic()
    assert Ros1File(path).chunks == []
    assert time.monotonic() - began < 20.0  # a minute where each is tried at each place before it


def test_a_chunk_does_not_reach_beyond_its_record(tmp_path):
    path = tmp_path / "drive.mcap"
    content = _chunk_head.pack(0, 0, 1 << 40, 0, 0) + (1 << 40).to_bytes(8, "little") + bytes(40)
    record = _record_head.pack(0x06, len(content)) + content
    path.write_bytes(MAGIC + 100 * record)
    found = McapFile(path).chunks
    assert [chunk.size for chunk in found] == 100 * [40]


class Overlapping(ChunkedFile):
    """As many chunks as bytes, of which each holds two messages a minute apart."""

    def __init__(self, path):
        super().__init__(path)
        self.channels = {0: TOPIC}
        for number in range(self._file_size):
            self.chunks.append(Chunk(number, 1))
            self.chunks[-1].note(0, number, number + 60_000_000_000, 2)

    def _load(self, chunk, wanted, allowance):
        return [(chunk.start_time, 0, bytes(100)), (chunk.end_time, 0, bytes(100))]

    @property
    def topics(self):
        return list(self.channels.values())


def test_what_waits_for_other_chunks_is_bounded(tmp_path, monkeypatch):
    path = tmp_path / "drive.overlapping"
    path.write_bytes(bytes(50))

    def times():
        return [message[1] for message in Overlapping(path).messages({TOPIC.name: TOPIC})]

    ordered = times()
    assert len(ordered) == 100
    assert ordered == sorted(ordered)
    monkeypatch.setattr(chunks, "_MOST_HELD", 1000)
    assert times() != ordered
    assert sorted(times()) == ordered


def test_a_scan_of_more_beams_than_any_scanner_has_is_dropped_and_told(tmp_path):
    def oversized(index):
        return {"ranges": [1.0] * 300_000} if index == 20 else {}

    path = write_bag(tmp_path / "drive.bag", 30, with_odometry=False, scans=oversized)
    scans, _, reader = read(path)
    assert len(scans) == 29
    assert numbers_of("oversized_messages", reader)["count"] == reader.counts["oversized_messages"] == 1
