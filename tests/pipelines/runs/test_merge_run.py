"""The sessions of several drives become one map, whatever their order."""

from itertools import permutations
from json import dumps
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, between, compose
from racecar.pipelines.commands.cli import run as run_command
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.session_file import load_session, save_session
from racecar.pipelines.runs.merge_run import merge_runs
from racecar.pipelines.runs.run_context import RunContext
from tests.mapping.sessions import RING, path, session
from tests.sensors.worlds import box

FRAMES = {"whole": IDENTITY, "part": np.array([40.0, -25.0, 2.5]), "other": IDENTITY}
PLACES = {"whole": path(0.0, 34.0), "part": path(11.0, 20.0), "other": path(0.0, 25.0)}
OTHER_RING = np.concatenate([box(-9, -7, 9, 7), box(-4.6, -2, 3.5, 1.5), box(0, -7, 1, -4), box(6, 0, 7, 1)])


@pytest.fixture
def folders(tmp_path: Path) -> list[Path]:
    for name, places in PLACES.items():
        walls = OTHER_RING if name == "other" else RING
        (tmp_path / name).mkdir()
        save_session(session(walls, places, FRAMES[name], IDENTITY), tmp_path / name / "session.npz")
    (tmp_path / "part" / "edits.yaml").write_text("- unknown: [[0, 0], [1, 0], [1, 1]]")
    return [tmp_path / name for name in PLACES]


def test_the_order_does_not_matter(folders: list[Path]) -> None:
    results = []
    for order in list(permutations(folders))[::3]:
        report = Report("racecar merge")
        run = merge_runs(order, Config(), RunContext(report))
        told = report.as_dict()["result"]
        assert [Path(folder).name for folder in told["left_out"]] == ["other"]
        why, remedy = report.warnings
        assert "other was left out: the drive was not recognized" in why
        assert "with that as the initial pose (parameters continued and initial_pose" in remedy
        results.append(run.result.session.map_from_keyframe)
    true = np.concatenate([PLACES["whole"], PLACES["part"]])
    assert np.abs(between(true, results[0])).max() < 0.02
    np.testing.assert_array_equal(results[0], results[1])
    whole, part = (np.array([*told["frames_of_sources"][str(folder)].values()]) for folder in folders[:2])
    np.testing.assert_allclose(compose(part, FRAMES["part"]), whole, atol=0.02)
    np.testing.assert_allclose(run.edits.edits[0].points[0], part[:2], atol=1e-3)


def test_a_recording_does_not_count_twice_also_from_another_merge(
    folders: list[Path], tmp_path: Path
) -> None:
    whole, part, _ = folders
    again, both = tmp_path / "again", tmp_path / "both"
    copytree(whole, again)
    report = Report("racecar merge")
    merge_runs([again, part, whole], Config(), RunContext(report)).save(both)
    assert set(report.as_dict()["result"]["frames_of_sources"]) == {str(again), str(part)}
    assert "whole was left out: it is of the same recording as" in report.warnings[0]
    with pytest.raises(UserError, match=r"\S*part: it is of the same recording as \S*both"):
        merge_runs([both, part], Config(), RunContext())


def test_the_way_from_one_recording_to_the_next_does_not_count(folders: list[Path]) -> None:
    whole, part, _ = folders
    run = merge_runs([whole, part], Config(), RunContext())
    driven = sum(load_session(folder).path[-1] for folder in (whole, part))
    assert run.quality.statistics["path_m"] == pytest.approx(driven, abs=0.1)


def test_any_map_may_be_the_first(folders: list[Path], tmp_path: Path) -> None:
    """The longest fits none of the others, which fit each other."""
    whole, part, _ = folders
    far = tmp_path / "far"
    far.mkdir()
    save_session(session(OTHER_RING, path(0.0, 45.0), IDENTITY, IDENTITY), far / "session.npz")
    report = Report("racecar merge")
    merge_runs([far, part, whole], Config(), RunContext(report))
    assert set(report.as_dict()["result"]["frames_of_sources"]) == {str(whole), str(part)}


def test_maps_of_other_places_are_not_merged(folders: list[Path]) -> None:
    whole, _, other = folders
    told = r"could be joined to \S*whole\. \S*other: the drive was .* --initial-pose.; else "
    with pytest.raises(UserError, match=told):
        merge_runs([other, whole], Config(), RunContext())


def test_a_merged_map_does_not_replace_that_of_a_drive(
    folders: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole, part, _ = folders
    drive = tmp_path / "drive"
    copytree(whole, drive)
    (drive / "trajectory.tum").write_text("")
    (drive / "report.json").write_text(dumps({"command": "racecar map"}))
    words = ["merge", str(whole), str(part), "--out", str(drive)]
    assert run_command(words) == 2
    assert "holds the results of `racecar map`, which would be replaced" in capsys.readouterr().err
    assert run_command([*words, "--replace", "--quiet"]) == 0
    assert not (drive / "trajectory.tum").exists()  # of a single drive
