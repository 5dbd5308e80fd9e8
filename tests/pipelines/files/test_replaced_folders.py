"""A folder is one run or none, whenever the process that replaces it is killed."""

import os
import stat
from collections.abc import Callable
from itertools import count
from pathlib import Path

import pytest

from racecar.maps import whole_folders
from racecar.maps.errors import UserError
from racecar.maps.whole_folders import finish_replacing, remove_with
from racecar.pipelines.files.outputs import whole_folder, written_to
from tests.killed import killed_at

OLD = dict.fromkeys(("map.pgm", "map.yaml", "report.json", "record/a.mcap", "mask.yaml"), "old")
NEW = dict.fromkeys(("map.pgm", "map.yaml", "report.json", "record/a.mcap", "walls.svg"), "new")
MINE = {"notes.txt": "mine", "record/notes.txt": "mine"}


@pytest.fixture(autouse=True)
def no_waiting_for_the_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)


def write_new(folder: Path) -> None:
    with whole_folder(folder) as staging:
        for name, content in NEW.items():
            (staging / name).parent.mkdir(exist_ok=True)
            (staging / name).write_text(content)
        remove_with(staging / "mask.yaml")


def write_all(folder: Path, contents: dict[str, str]) -> None:
    for name, content in contents.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)


def files(folder: Path) -> dict[str, str]:
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


def in_view(folder: Path) -> dict[str, str]:
    """The files that any program sees in a folder."""
    return {name: content for name, content in files(folder).items() if not name.startswith(".racecar")}


def no_run(folder: Path) -> None:
    pass


def old_run(folder: Path) -> None:
    write_all(folder, OLD | MINE)


@pytest.mark.parametrize("prepare", [no_run, old_run])
def test_at_every_call_a_kill_leaves_one_run_or_none(tmp_path: Path, prepare: Callable[[Path], None]) -> None:
    outcomes = []
    for call in count():
        home = tmp_path / str(call)
        run = home / "new" / "run"
        prepare(run)
        before = files(run)
        was_killed = killed_at(call, lambda run=run: write_new(run))
        contents = {name: content for name, content in in_view(run).items() if content != "mine"}
        assert len(set(contents.values())) < 2, call
        finish_replacing(run / "map.yaml")
        after = in_view(run)
        mine = MINE if prepare is old_run else {}
        assert after in (before, NEW | mine), call
        outcomes.append(after == before)
        write_new(run)
        assert files(home) == {f"new/run/{name}": content for name, content in (NEW | mine).items()}
        assert not list(home.rglob(".racecar*"))
        if not was_killed:
            break
    assert outcomes == sorted(outcomes, reverse=True)
    assert outcomes.count(True) > 5
    assert outcomes.count(False) > 10


def killed_halfway(run: Path) -> int:
    """Kill a replacement of an old run when the first new file is in its place; at which call that was."""
    for call in count():
        old_run(run)
        assert killed_at(call, lambda: write_new(run))
        if "new" in in_view(run).values():
            return call
        finish_replacing(run)
    raise AssertionError


def test_what_cannot_be_finished_is_told(tmp_path: Path) -> None:
    run = tmp_path / "run"
    killed_halfway(run)
    blocked = run / "report.json"
    blocked.mkdir()
    with pytest.raises(UserError, match=r"run holds only a part of its new files.*move them by hand"):
        finish_replacing(run)
    blocked.rmdir()
    finish_replacing(run)
    assert in_view(run) == NEW | MINE


def test_a_run_that_lies_in_another_one_is_finished_with_it(tmp_path: Path) -> None:
    killed_halfway(tmp_path / "run")
    finish_replacing(tmp_path / "run" / "record" / "a.mcap")
    assert files(tmp_path / "run") == NEW | MINE


def test_without_locks_nothing_that_is_new_is_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on network drives, where another process may finish the same run."""
    monkeypatch.setattr(whole_folders, "_lock", lambda descriptor: False)
    run = tmp_path / "run"
    old_run(run)
    replace, others = os.replace, [True]

    def overtake(source: Path, target: str) -> None:
        if others:
            others.clear()
            finish_replacing(run)
        replace(source, target)

    monkeypatch.setattr(os, "replace", overtake)
    write_new(run)
    assert files(run) == NEW | MINE


def test_what_a_stranger_left_where_all_may_write_is_let_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = tmp_path / "run"
    killed_halfway(run)
    before = files(run)
    run.chmod(run.stat().st_mode | stat.S_ISVTX)
    monkeypatch.setattr(os, "geteuid", lambda: run.stat().st_uid + 1)
    finish_replacing(run)
    assert files(run) == before
    with pytest.raises(UserError, match=r"Cannot write to .*run"):
        write_new(run)
    assert files(run) == before


@pytest.mark.parametrize("name", ["map.yaml", "mask.yaml"])
def test_a_file_that_cannot_go_to_its_place_is_told_before_anything_changes(
    tmp_path: Path, name: str
) -> None:
    old_run(tmp_path)
    (tmp_path / name).unlink()
    write_all(tmp_path, {f"{name}/inside": "mine"})
    before = files(tmp_path)
    with pytest.raises(UserError, match=rf"Cannot write to .*{name}: it is a folder"):
        write_new(tmp_path)
    assert files(tmp_path) == before


def test_a_link_stays_and_what_it_leads_to_is_replaced(tmp_path: Path) -> None:
    run = tmp_path / "run"
    old_run(run)
    (run / "map.yaml").rename(tmp_path / "linked.yaml")
    (run / "map.yaml").symlink_to("../linked.yaml")
    write_new(run)
    assert (run / "map.yaml").is_symlink()
    assert (tmp_path / "linked.yaml").read_text() == "new"


def test_what_is_to_be_removed_is_not_named_as_written(tmp_path: Path) -> None:
    write_new(tmp_path)
    assert written_to(tmp_path) == ("map.pgm", "map.yaml", "record/", "report.json", "walls.svg")


def test_a_run_reaches_the_disk_before_it_takes_the_place_of_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old_run(tmp_path)
    synced: set[tuple[int, int]] = set()
    fsync, rename = os.fsync, os.rename

    def note(descriptor: int) -> None:
        there = os.fstat(descriptor)
        synced.add((there.st_dev, there.st_ino))
        fsync(descriptor)

    def check(source: Path, target: Path) -> None:
        for path in (Path(source), *Path(source).rglob("*")):
            assert (path.stat().st_dev, path.stat().st_ino) in synced
        rename(source, target)

    monkeypatch.setattr(os, "fsync", note)
    monkeypatch.setattr(os, "rename", check)
    write_new(tmp_path)
    assert (tmp_path.stat().st_dev, tmp_path.stat().st_ino) in synced
