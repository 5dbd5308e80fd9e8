"""Convergence of the particles' spread."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.localization.config import LocalizationConfig
from racecar.maps.errors import UserError
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.commands.cli import run
from racecar.pipelines.experiments.convergence import collapse, converge, converged
from racecar.pipelines.experiments.filters import over_seeds
from racecar.pipelines.experiments.page import COURSE_NAME, OURS_NAME
from racecar.pipelines.experiments.recording import Recording, bag_recording, stand_in, with_known_start
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.runs.evaluation.course_filter import CourseSettings


def collapse_of(extents: list[float]) -> dict[str, Any]:
    """Every 0.1 s; the first extent is that of the start."""
    count = len(extents)
    return collapse(0.1 * np.arange(count), np.column_stack([extents, np.zeros(count)]), np.full(count, 0.1))


@pytest.mark.parametrize(
    ("extents", "seconds"),
    [([3, 0.1, 0.1, 0.1], 0.1), ([3, 2, 0.1, 0.1], 0.2), ([3, 0.1, 0.6, 0.1], 0.3), ([0.1, 0.1, 0.1], 0.0)],
)
def test_time_until_the_cloud_stays_small(extents: list[float], seconds: float) -> None:
    assert collapse_of(extents)["seconds_until_small"] == pytest.approx(seconds)


def test_a_cloud_that_grows_again_at_the_end_is_not_small() -> None:
    assert np.isnan(collapse_of([3.0, 0.1, 0.1, 3.0])["seconds_until_small"])


def test_both_filters_collapse_about_the_car() -> None:
    ours, course = (converge(variant, None, 0, 0) for variant in (LocalizationConfig(), CourseSettings()))
    for measured in (ours, course):
        assert measured["extents_m"][0] > 1.5
        assert measured["extents_m"][-1] < 0.5
    runs = {("lab room", name): over_seeds([run]) for name, run in ((OURS_NAME, ours), (COURSE_NAME, course))}
    result = converged(runs)
    assert result.figures["lab room"][OURS_NAME]["seconds_until_small"][0] < 1.0
    (picture,) = result.pictures
    assert picture.png.startswith(b"\x89PNG")
    assert picture.svg.lstrip().startswith(b"<?xml")


def test_a_stand_in_starts_where_its_truth_does_and_can_be_cut() -> None:
    drive = stand_in(0, 3.0)
    assert drive.start is not None
    assert np.all(np.isfinite(drive.start))
    part = drive.first(1.0)
    assert 0 < len(part) < len(list(drive.messages()))
    assert part[-1].stamp - part[0].stamp <= 10**9


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated drive in the building, and nothing that says where it starts."""
    bag = tmp_path_factory.mktemp("drive") / "drive.bag"
    arguments = ["--noise", "slight", "--seed", "3", "--duration", "8", "--quiet"]
    assert run(["simulate", "--map", "building", "--out", str(bag), *arguments]) == 0
    return bag


def test_the_start_is_found_on_the_whole_map(drive: Path) -> None:
    truth = load_tum(drive.with_name("drive.ground_truth.tum"))
    recording = bag_recording(drive, Path("building"), partial(BagReader, drive))
    assert recording.start is None
    found = with_known_start(recording, LocalizationConfig(), 0).start
    assert found is not None
    assert np.hypot(*(found - truth.map_from_base[0])[:2]) < 0.1
    assert abs(found[2] - truth.map_from_base[0, 2]) < 0.05


def test_a_start_on_the_map_of_another_place_is_not_found(drive: Path) -> None:
    with pytest.raises(UserError, match=r"was not found in its first 60 s; give its initial pose "):
        with_known_start(
            bag_recording(drive, Path("track"), partial(BagReader, drive)), LocalizationConfig(), 0
        )


def test_the_command_searches_for_a_start_that_is_not_given(
    drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[Recording] = []
    result = converged({("lab room", OURS_NAME): over_seeds([collapse_of([3, 0.1, 0.1])])})
    monkeypatch.setattr(
        "racecar.pipelines.experiments.convergence.convergence",
        lambda settings, parallel: given.append(settings.recording) or result,
    )
    arguments = ["--bag", str(drive), "--map", "building", "--out", str(tmp_path), "--quiet"]
    assert run(["experiment", "convergence", *arguments]) == 0
    truth = load_tum(drive.with_name("drive.ground_truth.tum")).map_from_base[0]
    assert np.hypot(*(given[0].start - truth)[:2]) < 0.1
    written = json.loads((tmp_path / "report.json").read_text())["inputs"]["initial_pose"]
    assert written == pytest.approx(list(given[0].start))
