"""Bags that are cut off, damaged, or no bags at all."""

import shutil
from itertools import pairwise

import lz4.frame
import pytest
from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer

from racecar.maps.errors import UserError
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.storage.compression import Allowance, decompress_what_is_there
from tests.pipelines.bag_samples import (
    bags_of_all_formats,
    cut,
    cut_folder,
    file_of,
    read,
    write_again,
    write_bag,
)

COUNT = 4000


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return bags_of_all_formats(tmp_path_factory.mktemp("whole"), COUNT)


@pytest.mark.parametrize("share", [0.02, 0.3, 0.9])
@pytest.mark.parametrize("kind", ["ros1", "mcap", "sqlite"])
def test_a_cut_file_gives_what_it_has(whole, tmp_path, kind, share):
    file = file_of(whole[kind])
    scans, samples, reader = read(cut(file, tmp_path / file.name, share))
    # An index, and a table's index pages, stand among or behind the messages.
    assert len(scans) == pytest.approx(share * COUNT, rel=0.03, abs=45)
    assert len(samples) == pytest.approx(len(scans), abs=2)
    assert any("cut off" in warning for warning in reader.warnings)
    assert any(f"{len(scans) + len(samples) + 1} messages" in warning for warning in reader.warnings)
    if kind != "mcap":  # which alone does not say how long it was
        lost = [warning for warning in reader.warnings if f"{1 - share:.0%} of its bytes are lost" in warning]
        assert lost
    steps = {later.stamp - earlier.stamp for earlier, later in pairwise(scans)}
    assert steps == {25_000_000}


@pytest.mark.parametrize("kind", ["mcap", "sqlite"])
def test_a_cut_folder_knows_how_many_messages_are_lost(whole, tmp_path, kind):
    scans, samples, reader = read(cut_folder(whole[kind], tmp_path / "cut", 0.5))
    total = len(scans) + len(samples) + 1
    assert any(f"{total} of {2 * COUNT + 1} messages (50%)" in warning for warning in reader.warnings)


@pytest.mark.parametrize("content", [None, "]: not yaml", "rosbag2_bagfile_information: 7"])
@pytest.mark.parametrize("kind", ["mcap", "sqlite"])
def test_a_folder_without_usable_metadata(whole, tmp_path, kind, content):
    folder = cut_folder(whole[kind], tmp_path / "copy", 1.0, with_metadata=False)
    if content:
        (folder / "metadata.yaml").write_text(content)
    scans, samples, reader = read(folder)
    assert (len(scans), len(samples), reader.warnings) == (COUNT, COUNT, [])


def test_a_folder_of_two_files_one_of_them_cut(whole, tmp_path):
    folder = tmp_path / "split"
    folder.mkdir()
    file = file_of(whole["mcap"])
    shutil.copy(file, folder / "drive_10.mcap")
    later = write_bag(tmp_path / "later", 100)
    cut(file_of(later), folder / "drive_9.mcap", 0.5)
    scans, _, reader = read(folder)
    assert len(scans) == COUNT
    assert reader.counts["dropped_duplicates"] > 0
    assert any("drive_9.mcap is cut off" in warning for warning in reader.warnings)


def test_a_schema_whose_names_are_no_text(whole, tmp_path):
    """SQLite quotes the damaged name in an error that Python then cannot decode."""
    copy = tmp_path / "drive.db3"
    copy.write_bytes(file_of(whole["sqlite"]).read_bytes().replace(b"ON messages (", b"ON mess\xb1ges ("))
    scans, _, reader = read(copy)
    assert len(scans) == COUNT
    assert any("drive.db3 is damaged" in warning for warning in reader.warnings)


def test_a_ros1_bag_that_was_never_closed(whole, tmp_path):
    """A recorder that crashed leaves the chunks, and a header that tells of no index."""
    content = bytearray(whole["ros1"].read_bytes())
    with Ros1Reader(whole["ros1"]) as reader:
        end = max(chunk.datapos + chunk.datasize for chunk in reader.chunks.values())
    at = content.index(b"index_pos=") + len(b"index_pos=")
    content[at : at + 8] = bytes(8)
    active = tmp_path / "drive.bag.active"
    active.write_bytes(content[:end])
    scans, _, reader = read(active)
    assert len(scans) == COUNT
    assert any("never closed" in warning for warning in reader.warnings)


@pytest.mark.parametrize("compression", [Ros1Writer.CompressionFormat.BZ2, Ros1Writer.CompressionFormat.LZ4])
def test_cut_compressed_chunks_of_ros1(whole, tmp_path, compression):
    packed = tmp_path / "packed.bag"
    writer = Ros1Writer(packed)
    writer.set_compression(compression)
    write_again(whole["ros1"], writer)
    assert len(read(packed)[0]) == COUNT
    scans, _, reader = read(cut(packed, tmp_path / "cut.bag", 0.6))
    assert 0.3 * COUNT < len(scans) < 0.7 * COUNT
    assert any("cut off" in warning for warning in reader.warnings)


def test_cut_compressed_chunks_of_mcap(whole, tmp_path):
    packed = tmp_path / "packed"
    writer = Ros2Writer(packed, version=8, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    write_again(whole["mcap"], writer)
    assert len(read(packed)[0]) == COUNT
    scans, _, _ = read(cut_folder(packed, tmp_path / "cut", 0.6))
    assert 0.4 * COUNT < len(scans) < 0.8 * COUNT


@pytest.mark.parametrize("kind", ["ros1", "mcap", "sqlite"])
def test_garbage_in_the_middle_costs_only_what_is_under_it(whole, tmp_path, kind):
    content = bytearray(file_of(whole[kind]).read_bytes())
    middle = len(content) // 2 + 300_000  # in the middle itself stands an index
    content[middle : middle + 3000] = b"\xa5" * 3000
    damaged = tmp_path / file_of(whole[kind]).name
    damaged.write_bytes(content)
    scans, _, reader = read(damaged)
    assert COUNT - 800 < len(scans) < COUNT  # a chunk or two
    assert any("damaged" in warning for warning in reader.warnings)


def test_half_a_compressed_block_gives_its_beginning():
    text = bytes(range(256)) * 4000
    packed = lz4.frame.compress(text, block_size=lz4.frame.BLOCKSIZE_MAX64KB)
    allowance = Allowance(len(packed))
    part = decompress_what_is_there(packed[: len(packed) // 2], "lz4", allowance)
    assert 0 < len(part) < len(text)
    assert text.startswith(part)
    assert decompress_what_is_there(b"no such thing", "zstd", allowance) == b""
    assert decompress_what_is_there(packed, "of another world", allowance) == b""


@pytest.mark.parametrize("name", ["drive.bag", "drive.mcap", "drive.db3"])
@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "is empty"),
        (b"Dear diary,\n", "is not a rosbag"),
        (b"\x28\xb5\x2f\xfd abc", "is compressed and damaged"),
    ],
)
def test_files_that_are_no_bags(tmp_path, name, content, reason):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(UserError, match=reason) as error:
        BagReader(path)
    assert str(path) in str(error.value)


def test_a_path_that_is_not_there(tmp_path):
    with pytest.raises(UserError, match="does not exist"):
        BagReader(tmp_path / "nothing.bag")


def test_folders_without_a_bag(tmp_path):
    with pytest.raises(UserError, match="holds no bag"):
        BagReader(tmp_path)
    write_bag(tmp_path / "drive.bag", 3)
    with pytest.raises(UserError, match=r"name one of them \(drive.bag\)"):
        BagReader(tmp_path)


@pytest.mark.parametrize("kind", ["ros1", "mcap", "sqlite"])
def test_a_file_cut_before_its_first_scan(whole, tmp_path, kind):
    file = file_of(whole[kind])
    short = tmp_path / file.name
    short.write_bytes(file.read_bytes()[:100])
    with pytest.raises(UserError, match="no laser scans"):
        BagReader(short)


@pytest.mark.parametrize("share", [0.3, 0.9])
@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("slam_benchmark/intel.bag", 13631),
        ("slam_benchmark/fr079/fr079.db3", 4934),
        ("slam_benchmark/aces/aces.mcap", 7374),
        ("racecar/session_A/session_A.mcap", 1877),
        ("racecar/localization_bag1.bag", 281),
        ("cartographer_runs/glc_ot_ez/glc_ot_ez.db3", 814),
    ],
)
def test_cut_copies_of_real_recordings(recordings, tmp_path, name, count, share):
    scans, _, reader = read(cut(recordings / name, tmp_path / name.split("/")[-1], share))
    assert len(scans) == pytest.approx(share * count, rel=0.08)
    assert any("cut off" in warning for warning in reader.warnings)
