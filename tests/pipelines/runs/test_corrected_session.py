"""Manual constraints in edits.yaml, through render and merge."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.mapping.mending.moments import keyframe_at
from racecar.mapping.session.recordings import KeyframeTimes, Recording
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import between
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.edits_file import EDITS_FILE, load_edits
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.session_file import load_session, save_session
from racecar.pipelines.files.tum import save_tum
from racecar.pipelines.runs.map_run import MapRun
from racecar.pipelines.runs.merge_run import merge_runs
from racecar.pipelines.runs.render_run import render_run
from racecar.pipelines.runs.run_context import RunContext
from tests.mapping.mending.bent import two_laps

EDITS = "# The laps lie on each other.\n- same_place: [5.0, 112.0]\n- wall: [[-1.0, 0.0], [1.0, 0.0]]\n"
LAP = 107
TURNED = MappingConfig(rendering={"turn": 0.5})


@pytest.fixture
def run(tmp_path: Path) -> Path:
    folder = tmp_path / "run"
    folder.mkdir()
    save_session(two_laps(), folder / "session.npz")
    save_tum(Trajectory(two_laps().times.stamps, two_laps().map_from_base), folder / "trajectory.tum")
    (folder / EDITS_FILE).write_text(EDITS)
    return folder


def rendered(source: Path, out: Path, config: MappingConfig = MappingConfig()) -> MapRun:  # noqa: B008
    sentences: list[str] = []
    drawn = render_run(source, config, RunContext(Report("racecar render"), announce=sentences.append))
    drawn.save(out)
    return drawn


def apart(run: MapRun) -> float:
    poses = run.result.session.map_from_keyframe
    right = between(poses[5], poses[5 + LAP])
    return float(np.hypot(right[0], right[1]))


def test_a_constraint_bends_map_path_and_edits_and_the_map_is_judged_again(run: Path, tmp_path: Path) -> None:
    drawn = rendered(run, tmp_path / "out")
    assert apart(drawn) < 0.2
    assert load_session(run).is_of(Trajectory(two_laps().times.stamps, two_laps().map_from_base))
    assert drawn.session.is_of(drawn.trajectory)
    assert drawn.report.as_dict()["quality"]["verdict"] == drawn.quality.verdict.value
    (told,) = drawn.report.as_dict()["corrections"][str(run)]
    assert told["edit"] == 1 and told["effect"].startswith("It moves ")


@pytest.mark.parametrize("config", [MappingConfig(), TURNED])
def test_rendering_again_gives_the_same_map_to_the_byte(
    run: Path, tmp_path: Path, config: MappingConfig
) -> None:
    first, again, turned = (tmp_path / name for name in ("first", "again", "turned"))
    rendered(run, first, config)
    assert "corrections" not in rendered(first, again).report.as_dict()
    for name in ("map.pgm", "session.npz", EDITS_FILE):
        assert (first / name).read_bytes() == (again / name).read_bytes()
    rendered(rendered_in(run, tmp_path / "straight"), turned, config)
    assert (first / "map.pgm").read_bytes() == (turned / "map.pgm").read_bytes()


def rendered_in(run: Path, out: Path) -> Path:
    rendered(run, out)
    return out


def test_without_its_constraint_the_map_is_as_it_was_measured(run: Path, tmp_path: Path) -> None:
    rendered(run, tmp_path / "bent")
    (tmp_path / "bent" / EDITS_FILE).write_text("")
    drawn = rendered(tmp_path / "bent", tmp_path / "plain")
    assert drawn.session.measured is None
    np.testing.assert_array_equal(drawn.session.map_from_keyframe, two_laps().map_from_keyframe)


def test_a_constraint_that_cannot_be_is_refused_by_its_number(run: Path, tmp_path: Path) -> None:
    (run / EDITS_FILE).write_text("- wall: [[0, 0], [1, 0]]\n- same_place: [30.0, 60.0]\n")
    with pytest.raises(UserError, match=r"Edit 2 .* is refused\. The scans contradict it"):
        rendered(run, tmp_path / "out")


def test_a_merged_map_keeps_the_constraints_of_each(run: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.mkdir()
    stamps = two_laps().times.stamps + 10**13  # recorded later
    later = KeyframeTimes.of(Recording("later", int(stamps[0]), int(stamps[-1])), stamps)
    drive = replace(two_laps(turn=0.0).moved(np.array([3.0, 4.0, 1.0])), times=later)
    save_session(drive, other / "session.npz")
    (other / EDITS_FILE).write_text("- same_place: [9.0, 116.0]\n")
    merged = merge_runs([run, other], Config(), RunContext(Report("racecar merge")))
    merged.save(tmp_path / "out")
    session = load_session(tmp_path / "out")
    assert session.measured is not None
    assert session.constraints.are("manual").sum() == 2
    numbers = session.times.numbers
    known = load_edits(tmp_path / "out" / EDITS_FILE).constraints
    assert [each.first.recording for each in known] == [0, 1]
    assert session.measured.mended_by == load_edits(tmp_path / "out" / EDITS_FILE).constraints_text
    for each in known:
        first, second = (keyframe_at(moment, session) for moment in (each.first, each.second))
        assert set(numbers[[first, second]].tolist()) == {each.first.recording}
        assert np.hypot(*between(*session.map_from_keyframe[[first, second]])[:2]) < 0.2
    again = render_run(tmp_path / "out", MappingConfig(), RunContext(Report("racecar render")))
    assert "corrections" not in again.report.as_dict()
