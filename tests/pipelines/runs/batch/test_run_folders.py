"""The folder of each bag: none is another's, and each stays its own."""

import json
from pathlib import Path

from racecar.pipelines.bags.storage.folder import bag_fingerprint
from racecar.pipelines.runs.batch.run_folders import run_folders
from tests.pipelines.bag_samples import write_bag


def bag(path: Path, content: str | None = None) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content or str(path))
    return path


def mapped(folder: Path, of: Path) -> None:
    folder.mkdir(parents=True)
    inputs = {"bag": str(of), "bag_fingerprint": bag_fingerprint(of)}
    (folder / "report.json").write_text(json.dumps({"inputs": inputs}))


def names(bags: list[Path], out: Path) -> list[str]:
    folders = run_folders(bags, out, reserved=("batch.html",))
    assert all(folder.parent == out for folder in folders)
    return [folder.name for folder in folders]


def test_bags_of_the_same_name_are_told_apart(tmp_path: Path) -> None:
    paths = ("monday/drive.bag", "tuesday/drive.mcap", "week/tuesday/drive.bag", "tuesday/Drive.bag")
    bags = [bag(tmp_path / path) for path in (*paths, "batch.html.bag")]
    last = [f"{tmp_path.name}-tuesday-Drive", f"{tmp_path.name}-batch.html"]
    assert names(bags, tmp_path / "out") == ["drive", "tuesday-drive", "week-tuesday-drive", *last]


def test_a_run_stays_that_of_its_bag(tmp_path: Path) -> None:
    out, one, two = tmp_path / "out", bag(tmp_path / "one/drive.bag"), bag(tmp_path / "two/drive.bag")
    mapped(out / "drive", two)
    assert names([one, two], out) == ["one-drive", "drive"]
    assert names([one], out) == ["one-drive"]  # and is not replaced while its bag is not in the batch


def test_a_run_is_found_when_its_bag_moved_or_changed(tmp_path: Path) -> None:
    out, drive = tmp_path / "out", bag(tmp_path / "drive.bag", "one")
    mapped(out / "drive", drive)
    moved = bag(tmp_path / "disk/moved.bag", "one")
    bag(drive, "another")
    assert names([drive], out) == ["drive"]
    assert names([drive, moved], out) == [f"{tmp_path.name}-drive", "drive"]


def test_copies_have_folders_of_their_own(tmp_path: Path) -> None:
    out, one, two = tmp_path / "out", bag(tmp_path / "a/drive.bag", "x"), bag(tmp_path / "b/drive.bag", "x")
    assert names([one, two], out) == ["drive", "b-drive"]
    mapped(out / "drive", one)
    mapped(out / "b-drive", two)
    assert names([one, two], out) == ["drive", "b-drive"]


def test_neither_a_bag_nor_a_map_of_others_is_written_into(tmp_path: Path) -> None:
    drive = write_bag(tmp_path / "drive", 3)
    bag(tmp_path / "map" / "map.yaml")
    bags = [drive, bag(tmp_path / "other" / "map.bag")]
    assert names(bags, tmp_path) == [f"{tmp_path.name}-drive", "other-map"]


def test_a_name_as_long_as_names_are_leaves_room(tmp_path: Path) -> None:
    bags = [bag(tmp_path / folder / f"{'x' * 240}.bag") for folder in ("a", "b")]
    found = names(bags, tmp_path / "out")
    assert len(set(found)) == 2
    assert max(map(len, found)) < 130
