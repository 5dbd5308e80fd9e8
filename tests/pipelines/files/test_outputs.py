import os
from pathlib import Path

import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.files.outputs import whole_folder, written_to


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_folder_appears_whole(tmp_path: Path) -> None:
    target = tmp_path / "new" / "run"
    with whole_folder(target) as staging:
        (staging / "map").mkdir()
        (staging / "map" / "map.yaml").write_text("a")
        (staging / "report.json").write_text("b")
        assert not target.exists()
    assert (target / "map" / "map.yaml").read_text() == "a"
    assert names(target) == ["map", "report.json"]
    assert names(tmp_path) == ["new"]


def test_folder_keeps_files_of_others(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "report.json").write_text("old")
    with whole_folder(tmp_path) as staging:
        (staging / "report.json").write_text("new")
    assert names(tmp_path) == ["notes.txt", "report.json"]
    assert (tmp_path / "report.json").read_text() == "new"


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_folder_is_untouched_after_an_error(tmp_path: Path, error: type[BaseException]) -> None:
    (tmp_path / "report.json").write_text("old")

    def fail(target: Path) -> None:
        with whole_folder(target) as staging:
            (staging / "report.json").write_text("new")
            raise error

    for target in (tmp_path, tmp_path / "new" / "run"):
        with pytest.raises(error):
            fail(target)
    assert names(tmp_path) == ["report.json"]
    assert (tmp_path / "report.json").read_text() == "old"


def test_folder_that_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "run").write_text("")
    with pytest.raises(UserError, match="is a file"), whole_folder(tmp_path / "run"):
        pass
    with pytest.raises(UserError, match="Cannot write"), whole_folder(tmp_path / "run" / "below"):
        pass


def test_folder_that_cannot_be_written_is_refused_at_once() -> None:
    entered = False
    with pytest.raises(UserError, match="/proc/run"), whole_folder(Path("/proc/run")):
        entered = True
    assert not entered


def test_what_was_written_is_known_afterwards(tmp_path: Path) -> None:
    target = tmp_path / "run"
    assert written_to(target) == ()
    with whole_folder(target) as staging:
        (staging / "record").mkdir()
        (staging / "map.png").write_text("a")
    (target / "notes.txt").write_text("mine")
    assert written_to(target) == ("map.png", "record/")
    with pytest.raises(KeyboardInterrupt), whole_folder(target):
        raise KeyboardInterrupt
    with whole_folder(target) as staging:
        (staging / "report.json").write_text("b")
    assert written_to(target) == ("report.json",)


def test_the_report_comes_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever waits for it finds the other files."""
    moved: list[str] = []
    replace = os.replace

    def note(source: Path, target: str) -> None:
        moved.append(Path(source).name)
        replace(source, target)

    with whole_folder(tmp_path / "run") as staging:
        (staging / "record").mkdir()
        for name in ("report.json", "map.yaml", "session.npz", "trajectory.tum", "record/record_0.mcap"):
            (staging / name).write_text("a")
        monkeypatch.setattr(os, "replace", note)
    assert len(moved) == 5
    assert moved[-1] == "report.json"
