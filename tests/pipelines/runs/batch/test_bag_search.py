"""Which bags a list or a folder means."""

from pathlib import Path

import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.runs.batch.bag_search import bag_stem, find_bags
from tests.pipelines.bag_samples import as_sqlite, write_bag


def found(source: Path, out: Path | None = None) -> list[str]:
    home = source if source.is_dir() else source.parent
    return [str(bag.relative_to(home.absolute())) for bag in find_bags(source, out or home / "out")]


def test_a_folder_is_searched_for_bags_of_every_kind(tmp_path: Path) -> None:
    for name in ("drive_2.bag", "drive_10.bag", "week/ros2"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        write_bag(tmp_path / name, 5)
    as_sqlite(tmp_path / "week/ros2", tmp_path / "week/sqlite")
    (tmp_path / "week/sqlite/metadata.yaml").unlink()  # as when the recorder was killed
    lone = next((tmp_path / "week/ros2").glob("*.mcap"))
    (tmp_path / "lone").mkdir()
    for name in ("a.mcap", "b.mcap", "nameless"):
        (tmp_path / "lone" / name).write_bytes(lone.read_bytes())
    (tmp_path / "broken.bag").write_text("no bag")
    (tmp_path / "notes.txt").write_text("no bag")
    (tmp_path / ".hidden").mkdir()
    (tmp_path / ".hidden/drive.bag").write_text("no bag")
    assert found(tmp_path) == [
        *("broken.bag", "drive_2.bag", "drive_10.bag"),
        *("lone/a.mcap", "lone/b.mcap", "lone/nameless"),
        *("week/ros2", "week/sqlite"),
    ]


def test_recordings_of_runs_are_no_drives(tmp_path: Path) -> None:
    for folder in ("", "maps/drive", "elsewhere/drive"):
        (tmp_path / folder).mkdir(parents=True, exist_ok=True)
        (tmp_path / folder / "drive.bag").write_text("a bag")
    for run in ("maps/drive", "elsewhere/drive"):
        (tmp_path / run / "report.json").write_text("{}")
        (tmp_path / run / "record").mkdir()
        (tmp_path / run / "record/record_0.mcap").write_text("a bag")
    assert found(tmp_path, tmp_path / "maps") == ["drive.bag", "elsewhere/drive/drive.bag"]


def test_links_that_lead_around_are_followed_once(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "one/drive.bag").write_text("a bag")
    (tmp_path / "one/around").symlink_to(tmp_path)
    (tmp_path / "two.bag").symlink_to(tmp_path / "one/drive.bag")
    assert found(tmp_path) == ["one/drive.bag"]


def test_a_bag_is_a_batch_of_one(tmp_path: Path) -> None:
    assert find_bags(write_bag(tmp_path / "drive.bag", 5), tmp_path) == [tmp_path / "drive.bag"]
    assert find_bags(write_bag(tmp_path / "drive", 5), tmp_path) == [tmp_path / "drive"]


def test_a_list_names_bags_and_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("lists", "here", "lists/week"):
        (tmp_path / name).mkdir()
    for name in ("lists/beside.bag", "here/here.bag", "lists/week/deep.bag", "absolute.bag"):
        (tmp_path / name).write_text("a bag")
    lines = [
        "\ufeff# drives",
        "",
        "beside.bag",
        " here.bag ",
        "week",
        str(tmp_path / "absolute.bag"),
        "beside.bag",
    ]
    (tmp_path / "lists/list.txt").write_text("\r\n".join([*lines, "missing.bag", "empty"]), "utf-8")
    (tmp_path / "lists/empty").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    names = ["lists/beside.bag", "here/here.bag", "lists/week/deep.bag", "absolute.bag"]
    names += ["lists/missing.bag", "lists/empty"]  # each has a row that says what is wrong
    assert find_bags(tmp_path / "lists/list.txt", tmp_path / "out") == [tmp_path / name for name in names]


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"\n# none\n", "lists no bags"),
        (b"\xff\xfe\x00", "is not a text file"),
        (b"a\0b", "is not a list of bags"),
    ],
)
def test_what_is_no_list_is_told(content: bytes, sentence: str, tmp_path: Path) -> None:
    (tmp_path / "list.txt").write_bytes(content)
    with pytest.raises(UserError, match=sentence):
        find_bags(tmp_path / "list.txt", tmp_path / "out")


def test_nothing_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="There is no bag in"):
        find_bags(tmp_path, tmp_path / "out")
    with pytest.raises(UserError, match="Cannot read"):
        find_bags(tmp_path / "list.txt", tmp_path / "out")


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("a.bag", "a"),
        ("a_0.mcap", "a_0"),
        ("a.db3.zstd", "a"),
        ("a.bag.active", "a"),
        ("a.b", "a.b"),
        (".bag", ".bag"),
    ],
)
def test_the_name_of_a_bag(name: str, stem: str) -> None:
    assert bag_stem(Path(name)) == stem
