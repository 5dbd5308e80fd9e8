import shutil
from pathlib import Path

from racecar.pipelines.bags.storage.folder import bag_fingerprint


def bag_of(folder: Path, begin: bytes, length: int, end: bytes) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "drive_0.mcap").write_bytes(begin + bytes(length) + end)
    return folder


def test_a_copy_is_the_same_bag_whatever_else_lies_in_its_folder(tmp_path: Path) -> None:
    bag = bag_of(tmp_path / "a", b"begin", 5_000_000, b"end")
    copy = Path(shutil.copytree(bag, tmp_path / "copy"))
    (copy / "map.yaml").write_text("of this bag")
    assert bag_fingerprint(copy) == bag_fingerprint(bag)
    renamed = shutil.copy(bag / "drive_0.mcap", tmp_path / "renamed.mcap")
    assert bag_fingerprint(Path(renamed)) == bag_fingerprint(bag / "drive_0.mcap")


def test_bags_differ_by_either_end_and_by_length(tmp_path: Path) -> None:
    contents = [(b"begin", 5_000_000, b"end"), (b"other", 5_000_000, b"end"), (b"begin", 5_000_000, b"dne")]
    contents.append((b"begin", 5_000_001, b"end"))
    found = {
        bag_fingerprint(bag_of(tmp_path / str(number), *content)) for number, content in enumerate(contents)
    }
    assert len(found) == 4
