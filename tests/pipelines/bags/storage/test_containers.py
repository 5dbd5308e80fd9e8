"""Bags in every wrapping that recorders and people give them: all messages come, in the order of time."""

import shutil
import sqlite3
import struct
import sys

import lz4.frame
import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer

from racecar.maps.errors import UserError
from racecar.pipelines.bags.messages import LASER_SCAN, ODOMETRY, ros1_types, ros2_types
from racecar.pipelines.bags.storage.mcap import McapFile
from racecar.pipelines.bags.storage.ros1 import Ros1File
from racecar.pipelines.bags.storage.store import BagStore
from tests.pipelines.bag_samples import bags_of_all_formats, file_of, read, write_again, write_bag

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

COUNT = 300
_CHUNK = 0x06


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return bags_of_all_formats(tmp_path_factory.mktemp("whole"), COUNT)


def messages(path, topics=("/scan", "/odom", "/tf_static")):
    store = BagStore(path)
    read_messages = list(store.messages(topics))
    sentences = store.losses + [note.what for note in store.notes]
    store.close()
    return read_messages, sentences


def recording_in_progress(whole, folder):
    """A copy of a sqlite bag while its recorder goes on: the second half stands in the log alone."""
    everything = messages(whole["sqlite"])[0]
    work = folder / "work"
    work.mkdir()
    database = work / "rec_0.db3"
    shutil.copy(file_of(whole["sqlite"]), database)
    with sqlite3.connect(database) as connection:
        connection.execute("DELETE FROM messages WHERE id > ?", [len(everything) // 2])
    connection.close()
    connection = sqlite3.connect(database, isolation_level=None)
    connection.execute("VACUUM")
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA wal_autocheckpoint = 0")
    numbers = {
        name.decode() if isinstance(name, bytes) else name: number
        for number, name in connection.execute("SELECT id, name FROM topics")
    }
    connection.execute("BEGIN")
    for index, (topic, time, data) in enumerate(everything[len(everything) // 2 :]):
        values = [numbers[topic], time, data]
        connection.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", values)
        if index % 50 == 49:
            connection.execute("COMMIT")
            connection.execute("BEGIN")
    connection.execute("COMMIT")
    copy = folder / "copy"
    copy.mkdir()
    for file in work.iterdir():
        if not file.name.endswith("-shm"):
            shutil.copy(file, copy)
    connection.close()
    return copy


@pytest.mark.parametrize("named", ["folder", "file"])
def test_a_sqlite_bag_copied_while_it_was_recorded(whole, tmp_path, named):
    copy = recording_in_progress(whole, tmp_path)
    before = {file.name: file.read_bytes() for file in copy.iterdir()}
    assert before.keys() == {"rec_0.db3", "rec_0.db3-wal"}
    copy.chmod(0o555)
    found = messages(copy if named == "folder" else copy / "rec_0.db3")
    copy.chmod(0o755)
    assert found == (messages(whole["sqlite"])[0], [])
    assert {file.name: file.read_bytes() for file in copy.iterdir()} == before


def test_a_log_that_was_cut_while_it_was_copied_gives_its_whole_transactions(whole, tmp_path):
    copy = recording_in_progress(whole, tmp_path)
    log = copy / "rec_0.db3-wal"
    log.write_bytes(log.read_bytes()[: int(log.stat().st_size * 0.7)])
    expected = messages(whole["sqlite"])[0]
    found, _ = messages(copy)
    assert 0.7 * len(expected) < len(found) < len(expected)
    assert found == expected[: len(found)]


def test_frames_of_an_earlier_use_of_the_log_are_left_aside(whole, tmp_path):
    copy = recording_in_progress(whole, tmp_path)
    log = copy / "rec_0.db3-wal"
    content = bytearray(log.read_bytes())
    step = 24 + struct.unpack_from(">I", content, 8)[0]
    for frame in range(32 + (len(content) - 32) // step // 2 * step, len(content), step):
        content[frame + 8 : frame + 16] = b"old salt"
    log.write_bytes(content)
    expected = messages(whole["sqlite"])[0]
    found, _ = messages(copy)
    assert 0.5 * len(expected) <= len(found) < 0.9 * len(expected)
    assert found == expected[: len(found)]


def test_an_empty_log_changes_nothing(whole, tmp_path):
    shutil.copy(file_of(whole["sqlite"]), tmp_path / "rec_0.db3")
    (tmp_path / "rec_0.db3-wal").touch()
    assert messages(tmp_path) == (messages(whole["sqlite"])[0], [])


@pytest.mark.parametrize("suffix", [".zstd", ".zst"])
@pytest.mark.parametrize("kind", ["ros1", "mcap", "sqlite"])
def test_files_compressed_as_a_whole(whole, tmp_path, kind, suffix):
    file = file_of(whole[kind])
    packed = tmp_path / "bag" / (file.name + suffix)
    packed.parent.mkdir()
    packed.write_bytes(zstd.compress(file.read_bytes()))
    expected = messages(whole[kind])
    assert messages(packed) == expected
    if kind != "ros1":  # of which folders are not bags
        assert messages(packed.parent) == expected


def test_a_file_unpacked_beside_the_packed_one_is_read_once(whole, tmp_path):
    file = file_of(whole["mcap"])
    shutil.copy(file, tmp_path)
    (tmp_path / (file.name + ".zstd")).write_bytes(zstd.compress(file.read_bytes()))
    assert messages(tmp_path) == messages(whole["mcap"])


def test_half_a_compressed_file_gives_its_beginning(whole, tmp_path):
    content = zstd.compress(file_of(whole["mcap"]).read_bytes())
    packed = tmp_path / "drive.mcap.zstd"
    packed.write_bytes(content[: len(content) // 2])
    found, losses = messages(packed)
    assert 0 < len(found) < len(messages(whole["mcap"])[0])
    assert any("cut off" in loss for loss in losses)


def test_a_compressed_file_that_is_no_bag(tmp_path):
    packed = tmp_path / "diary.mcap.zstd"
    packed.write_bytes(zstd.compress(b"Dear diary,\n"))
    with pytest.raises(UserError, match=r"diary\.mcap\.zstd is compressed"):
        BagStore(packed)


@pytest.mark.parametrize("with_metadata", [True, False])
@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE, CompressionMode.STORAGE])
def test_compression_by_the_recorder(whole, tmp_path, mode, plugin, with_metadata):
    if mode == CompressionMode.STORAGE and plugin == StoragePlugin.SQLITE3:
        pytest.skip("sqlite has none")
    writer = Ros2Writer(tmp_path / "bag", version=8, storage_plugin=plugin)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    write_again(whole["mcap"], writer)
    if not with_metadata:
        (tmp_path / "bag" / "metadata.yaml").unlink()
    assert messages(tmp_path / "bag") == messages(whole["mcap"])


def test_chunks_compressed_by_lz4(whole, tmp_path):
    content = file_of(whole["mcap"]).read_bytes()
    out, position = bytearray(content[:8]), 8
    while position + 9 <= len(content) - 8:
        operation, size = struct.unpack_from("<BQ", content, position)
        record = content[position + 9 : position + 9 + size]
        if operation == _CHUNK:
            assert struct.unpack_from("<IQ", record, 28)[0] == 0  # no compression yet
            packed = lz4.frame.compress(record[40:])
            record = record[:28] + struct.pack("<I", 3) + b"lz4" + struct.pack("<Q", len(packed)) + packed
        out += struct.pack("<BQ", operation, len(record)) + record
        position += 9 + size
    packed_file = tmp_path / "drive.mcap"
    packed_file.write_bytes(bytes(out) + content[-8:])
    assert packed_file.stat().st_size < len(content)
    assert messages(packed_file) == messages(whole["mcap"])


@pytest.mark.parametrize("parts", [("drive.mcap", "drive_1.mcap"), ("drive_9.mcap", "drive_10.mcap")])
def test_metadata_that_names_only_the_first_part(whole, tmp_path, parts):
    first, second = parts
    expected, _ = messages(whole["mcap"])
    split(tmp_path, {first: expected[: COUNT // 2], second: expected[COUNT // 2 :]})
    metadata = f"rosbag2_bagfile_information: {{relative_file_paths: [{first}], message_count: {COUNT // 2}}}"
    (tmp_path / "metadata.yaml").write_text(metadata)
    found, sentences = messages(tmp_path)
    assert found == expected
    assert sentences == [f"Parts of the recording that metadata.yaml does not name are read too: {second}."]


def test_another_recording_in_the_folder_is_left_aside_and_a_missing_part_told(whole, tmp_path):
    expected, _ = messages(whole["mcap"])
    split(tmp_path, {"drive_1.mcap": expected, "filtered.mcap": expected[:20]})
    paths = "[drive_0.mcap, drive_1.mcap]"
    (tmp_path / "metadata.yaml").write_text(f"rosbag2_bagfile_information: {{relative_file_paths: {paths}}}")
    found, (loss, note) = messages(tmp_path)
    assert found == expected
    assert "drive_0.mcap is missing" in loss
    assert "filtered.mcap: it is not read" in note


def test_files_of_two_recorders_are_read_in_the_order_of_time(whole, tmp_path):
    expected, _ = messages(whole["mcap"])
    split(
        tmp_path,
        {
            "a.mcap": [message for message in expected if message[0] != "/odom"],
            "b.mcap": [message for message in expected if message[0] == "/odom"],
        },
    )
    found, sentences = messages(tmp_path)
    assert sentences == []
    assert sorted(found) == sorted(expected)
    assert [message[1] for message in found] == [message[1] for message in expected]


def split(folder, files):
    """Messages written to mcap files of these names."""
    types = {"/scan": LASER_SCAN, "/odom": ODOMETRY, "/tf_static": "tf2_msgs/msg/TFMessage"}
    for index, (name, written) in enumerate(files.items()):
        work = folder / f"work{index}"
        with Ros2Writer(work, version=8, storage_plugin=StoragePlugin.MCAP) as writer:
            connections = {
                topic: writer.add_connection(topic, types[topic], typestore=ros2_types())
                for topic in dict.fromkeys(message[0] for message in written)
            }
            for topic, time, data in written:
                writer.write(connections[topic], time, data)
        shutil.move(next(work.glob("*.mcap")), folder / name)
        shutil.rmtree(work)


@pytest.mark.parametrize("kind", ["ros1", "mcap", "sqlite"])
def test_a_topic_without_messages(whole, tmp_path, kind):
    """Recorders list what they subscribed to, whether anything came or not."""
    if kind == "ros1":
        bag = tmp_path / "drive.bag"
        writer, types = Ros1Writer(bag), ros1_types()
    else:
        bag = tmp_path / "drive"
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        writer, types = Ros2Writer(bag, version=8, storage_plugin=plugin), ros2_types()
    with writer:
        scans = writer.add_connection("/scan", LASER_SCAN, typestore=types)
        for topic in ("/tf_static", "/tf"):
            writer.add_connection(topic, "tf2_msgs/msg/TFMessage", typestore=types)
        writer.add_connection("/odom", ODOMETRY, typestore=types)
        for _, time, data in messages(whole[kind], ["/scan"])[0]:
            writer.write(scans, time, data)
    assert messages(bag, ["/tf_static"]) == ([], [])
    scans, samples, reader = read(bag)
    assert (len(scans), len(samples), reader.odom_topic) == (COUNT, 0, None)
    assert read(file_of(bag))[2].warnings == reader.warnings  # without metadata.yaml
    (tmp_path / "cut").mkdir()
    damaged = tmp_path / "cut" / file_of(bag).name
    damaged.write_bytes(file_of(bag).read_bytes()[:-300])
    assert len(read(damaged)[0]) > 0.9 * COUNT


def test_several_connections_of_one_topic(whole, tmp_path):
    """Each publisher of a ROS 1 topic has one; where their types differ, the commoner type is read."""
    expected, _ = messages(whole["ros1"], ["/scan"])
    bag = tmp_path / "drive.bag"
    with Ros1Writer(bag) as writer:
        connections = [
            writer.add_connection("/scan", LASER_SCAN, typestore=ros1_types(), callerid=f"/laser{number}")
            for number in range(2)
        ]
        other = writer.add_connection("/scan", ODOMETRY, typestore=ros1_types(), callerid="/odometry")
        for index, (_, time, data) in enumerate(expected):
            writer.write(connections[index % 2], time, data)
            if index % 100 == 0:
                writer.write(other, time, b"something else")
    found, sentences = messages(bag, ["/scan"])
    assert found == expected
    assert sentences == [
        f"/scan holds {LASER_SCAN}, and 3 messages of {ODOMETRY}, which are not read.",
    ]


def test_an_index_with_a_wrong_size_costs_nothing(whole, tmp_path):
    """As an early recorder wrote it; rosbag goes by the count of entries."""
    content = bytearray(whole["ros1"].read_bytes())
    at = content.index(b"\0count=") + 1
    count = struct.unpack_from("<I", content, at + 6)[0]
    size_at = content.index(struct.pack("<I", 12 * count), at)
    struct.pack_into("<I", content, size_at, 20 * count)
    bag = tmp_path / "drive.bag"
    bag.write_bytes(content)
    assert messages(bag) == messages(whole["ros1"])


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_behind_a_damaged_record_the_next_chunk_is_found(tmp_path, kind):
    bag = write_bag(tmp_path / ("drive.bag" if kind == "ros1" else "drive"), 2000)
    expected, _ = messages(bag)
    chunks = (Ros1File if kind == "ros1" else McapFile)(file_of(bag)).chunks
    assert len(chunks) > 2
    content = bytearray(file_of(bag).read_bytes())
    content[chunks[1].begin - 49 : chunks[1].begin - 9] = b"\xff" * 40  # the head of its record
    damaged = tmp_path / "damaged"
    damaged.write_bytes(content)
    found, losses = messages(damaged)
    lost = sum(chunks[1].counts.values())
    assert len(found) == len(expected) - lost
    assert found[-1] == expected[-1]
    assert any("is damaged" in loss for loss in losses)


@pytest.mark.parametrize("kind", ["file", "message"])
def test_a_decompression_bomb_does_not_go_off(whole, tmp_path, kind):
    bomb = zstd.compress(bytes(1 << 28))
    if kind == "file":
        packed = tmp_path / "drive.mcap.zstd"
        packed.write_bytes(bomb)
        with pytest.raises(UserError, match="not a rosbag"):
            BagStore(packed)
        return
    with Ros2Writer(tmp_path / "bag", version=8, storage_plugin=StoragePlugin.MCAP) as writer:
        scans = writer.add_connection("/scan", LASER_SCAN, typestore=ros2_types())
        writer.write(scans, 1, bomb)
    ((_, _, data),), _ = messages(tmp_path / "bag")
    assert len(data) < 1 << 27


def test_an_early_recording_whose_indices_have_wrong_sizes(recordings):
    found, losses = messages(recordings / "strangers/matcher_demo/matcher_demo.bag")
    assert (len(found), losses) == (360, [])
