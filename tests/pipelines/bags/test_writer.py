"""Bags appear whole or not at all."""

import pytest
from rosbags.highlevel import AnyReader

from racecar.maps.errors import UserError
from racecar.pipelines.bags.writer import BagWriter
from tests.pipelines.bag_samples import PLACE, START, read, write_bag, write_scan


@pytest.mark.parametrize("name", ["drive.bag", "drive"])
def test_others_can_read_it(tmp_path, name):
    path = write_bag(tmp_path / name, 10)
    with AnyReader([path]) as reader:
        counts = {connection.topic: connection.msgcount for connection in reader.connections}
        times = [time for _, time, _ in reader.messages()]
        stamps = [
            reader.deserialize(data, c.msgtype).header.stamp
            for c, _, data in reader.messages()
            if c.topic == "/scan"
        ]
    assert counts == {"/tf_static": 1, "/odom": 10, "/scan": 10}
    assert times == sorted(times)
    assert stamps[0].sec * 10**9 + stamps[0].nanosec == START
    assert {file.name for file in tmp_path.iterdir()} == {name}


@pytest.mark.parametrize("name", ["drive.bag", "drive"])
@pytest.mark.parametrize("is_there", [False, True])
def test_a_failure_leaves_what_was_there(tmp_path, name, is_there):
    path = write_bag(tmp_path / name, 10) if is_there else tmp_path / name
    with pytest.raises(KeyError), BagWriter(path) as writer:
        write_scan(writer, 0)
        raise KeyError
    assert [each.name for each in tmp_path.iterdir()] == [name] * is_there
    if is_there:
        assert len(read(path)[0]) == 10
        write_bag(path, 20)
        assert len(read(path)[0]) == 20


@pytest.mark.parametrize("name", ["drive.mcap", "drive.db3"])
def test_lone_files_are_not_written(tmp_path, name):
    with pytest.raises(UserError, match=r"name a \.bag file, or a folder"):
        BagWriter(tmp_path / name)


def test_a_transform_alone_is_written(tmp_path):
    with BagWriter(tmp_path / "drive") as writer:
        writer.write_static_transform(PLACE)
    with AnyReader([tmp_path / "drive"]) as reader:
        assert [connection.topic for connection in reader.connections] == ["/tf_static"]
