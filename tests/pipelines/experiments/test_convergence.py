"""Convergence of the particles' spread."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from racecar.localization.config import LocalizationConfig
from racecar.maps.errors import UserError
from racecar.pipelines.commands.cli import run
from racecar.pipelines.experiments.convergence import converge, converged, seconds_until_small
from racecar.pipelines.experiments.figure_style import COURSE_NAME, OURS_NAME
from racecar.pipelines.experiments.recording import BagRecording, StandIn, first_seconds, known_start
from racecar.pipelines.experiments.start_search import found_start
from racecar.pipelines.experiments.tracking import Track
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.runs.evaluation.course_filter import CourseSettings


def run_of(extents: list[float]) -> Track:
    """Scans every 0.1 s; the first extent is that of the start."""
    count = len(extents) - 1
    return Track(
        10**8 * np.arange(count, dtype=np.int64),
        np.zeros((count, 3)),
        np.column_stack([extents, np.zeros(len(extents))]),
        np.full(len(extents), 0.1),
        np.ones(count),
        np.ones(count),
    )


@pytest.mark.parametrize(
    ("extents", "seconds"),
    [([3, 0.1, 0.1, 0.1], 0.1), ([3, 2, 0.1, 0.1], 0.2), ([3, 0.1, 0.6, 0.1], 0.3), ([0.1, 0.1, 0.1], 0.0)],
)
def test_time_until_the_cloud_stays_small(extents: list[float], seconds: float) -> None:
    assert seconds_until_small(run_of(extents)) == pytest.approx(seconds)


def test_a_cloud_that_grows_again_at_the_end_is_not_small() -> None:
    assert np.isnan(seconds_until_small(run_of([3.0, 0.1, 0.1, 3.0])))


def test_both_filters_collapse_about_the_car() -> None:
    ours, course = (converge(variant, None, 0, 0) for variant in (LocalizationConfig(), CourseSettings()))
    for tracked in (ours, course):
        assert tracked.extents[0].min() > 1.5
        assert tracked.extents[-1].max() < 0.5
    result = converged({("lab room", OURS_NAME): [ours], ("lab room", COURSE_NAME): [course]})
    assert result.figures["lab room"][OURS_NAME]["seconds_until_small"][0] < 1.0
    (picture,) = result.pictures
    assert picture.png.startswith(b"\x89PNG")
    assert picture.svg.lstrip().startswith(b"<?xml")


def test_a_stand_in_starts_where_its_truth_does_and_can_be_cut() -> None:
    stand_in = StandIn(0, 3.0)
    assert np.all(np.isfinite(known_start(stand_in)))
    whole, part = list(stand_in.messages()), list(first_seconds(stand_in.messages(), 1.0))
    assert 0 < len(part) < len(whole)
    assert part[-1].stamp - part[0].stamp <= 10**9


def test_a_recording_without_a_known_start_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="--initial-pose"):
        known_start(BagRecording(tmp_path / "drive.bag", Path("building")))


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> BagRecording:
    """A simulated drive in the building, and nothing that says where it starts."""
    bag = tmp_path_factory.mktemp("drive") / "drive.bag"
    arguments = ["--noise", "slight", "--seed", "3", "--duration", "8", "--quiet"]
    assert run(["simulate", "--map", "building", "--out", str(bag), *arguments]) == 0
    return BagRecording(bag, Path("building"))


def test_the_start_is_found_on_the_whole_map(drive: BagRecording) -> None:
    truth = load_tum(drive.bag.with_name("drive.ground_truth.tum"))
    found = found_start(drive, LocalizationConfig(), 0)
    assert np.hypot(*(found - truth.map_from_base[0])[:2]) < 0.1
    assert abs(found[2] - truth.map_from_base[0, 2]) < 0.05


def test_a_start_on_the_map_of_another_place_is_not_found(drive: BagRecording) -> None:
    with pytest.raises(UserError, match=r"was not found in its first 60 s; give --initial-pose"):
        found_start(replace(drive, map=Path("track")), LocalizationConfig(), 0)


def test_the_command_searches_for_a_start_that_is_not_given(
    drive: BagRecording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = []
    result = converged({("lab room", OURS_NAME): [run_of([3, 0.1, 0.1])]})
    monkeypatch.setattr(
        "racecar.pipelines.experiments.convergence.convergence",
        lambda settings, parallel: given.append(settings.recording) or result,
    )
    arguments = ["--bag", str(drive.bag), "--map", "building", "--out", str(tmp_path), "--quiet"]
    assert run(["experiment", "convergence", *arguments]) == 0
    truth = load_tum(drive.bag.with_name("drive.ground_truth.tum")).map_from_base[0]
    assert np.hypot(*(given[0].start() - truth)[:2]) < 0.1
    written = json.loads((tmp_path / "report.json").read_text())["inputs"]["initial_pose"]
    assert written == pytest.approx(list(given[0].start()))
