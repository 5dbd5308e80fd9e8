"""Another bag format is one reader and one entry in the list of formats."""

import pickle

import numpy as np

from racecar.pipelines.bags.storage import formats
from racecar.pipelines.bags.storage.chunks import Chunk, ChunkedFile
from racecar.pipelines.bags.storage.formats import BagFormat
from racecar.pipelines.bags.storage.store import BagStore
from tests.pipelines.bag_samples import read, write_bag

MAGIC = b"PICKLED "


class PickledFile(ChunkedFile):
    """A bag in one piece, as Python writes it."""

    def __init__(self, path):
        super().__init__(path)
        topics, self._messages = pickle.loads(path.read_bytes()[len(MAGIC) :])
        self.channels = dict(enumerate(topics))
        self._numbers = {topic.name: number for number, topic in self.channels.items()}
        chunk = Chunk(len(MAGIC), self._file_size)
        for topic, time, _ in self._messages:
            chunk.note(self._numbers[topic], time, time)
        self.chunks = [chunk]

    def _load(self, chunk, wanted, allowance):
        listed = [(time, self._numbers[topic], data) for topic, time, data in self._messages]
        return [message for message in listed if message[1] in wanted]


PICKLED = BagFormat(".pickled", MAGIC, ".pickled", is_ros2=False, open=PickledFile)


def test_a_registered_format_is_read_like_any_other(tmp_path, monkeypatch):
    known = write_bag(tmp_path / "drive.bag", 20)
    store = BagStore(known)
    contents = list(store.topics.values()), list(store.messages(list(store.topics)))
    store.close()
    (tmp_path / "drive.pickled").write_bytes(MAGIC + pickle.dumps(contents))

    monkeypatch.setattr(formats, "FORMATS", (*formats.FORMATS, PICKLED))
    expected_scans, expected_odometry, _ = read(known)
    scans, odometry, _ = read(tmp_path / "drive.pickled")
    assert [scan.stamp for scan in scans] == [scan.stamp for scan in expected_scans]
    np.testing.assert_array_equal(scans[-1].ranges, expected_scans[-1].ranges)
    assert len(odometry) == len(expected_odometry) == 20


def test_no_two_formats_begin_alike():
    magics = [known.magic for known in formats.FORMATS]
    assert not any(a.startswith(b) for a in magics for b in magics if a is not b)
