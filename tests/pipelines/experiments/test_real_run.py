"""A run without truth."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from racecar.localization.config import LocalizationConfig
from racecar.pipelines.experiments.experiment import ExperimentSettings
from racecar.pipelines.experiments.html_report import html_report
from racecar.pipelines.experiments.page import Page
from racecar.pipelines.experiments.real_run import LocalizedRecording, localized, seen
from racecar.pipelines.experiments.recording import stand_in
from racecar.pipelines.runs.parallel_runs import ParallelRuns

SETTINGS = ExperimentSettings(LocalizationConfig(particles=1000), 0, quick=True, recording=stand_in(0, 3.0))


@pytest.fixture(scope="module")
def run() -> LocalizedRecording:
    return localized(stand_in(0, 3.0), SETTINGS, ParallelRuns(quiet=True))


def test_tells_what_can_be_told(run: LocalizedRecording) -> None:
    figures = seen(run).figures
    assert figures["scans"] == 60
    assert np.mean(figures["shares_on_wall"]) > 0.9
    assert figures["end_error_m"] < 0.2
    assert len(figures["measured_times"]["update_ms"]) == 60
    assert [len(figures[name]) for name in ("extents_m", "deviations_m", "effective_sample_sizes")] == [
        60
    ] * 3


def test_moments_lie_on_the_walls(run: LocalizedRecording) -> None:
    assert len(run.moments) == 4
    assert all(moment.share_on_wall > 0.8 for moment in run.moments)
    assert run.moments[0].stamp < run.moments[-1].stamp


def test_the_tape_measure_is_compared_in_place_and_heading_as_far_as_measured(
    run: LocalizedRecording,
) -> None:
    def measured(end_pose: tuple[float, ...] | None) -> Page:
        return seen(replace(run, recording=replace(run.recording, end=end_pose)))

    end = run.run.map_from_base[-1] + np.array([0.3, 0.4, 0.1])
    result = measured(tuple(end))
    assert result.figures["end_error_m"] == pytest.approx(0.5)
    assert result.figures["end_heading_error_deg"] == pytest.approx(np.degrees(0.1))
    assert "50.0 cm and 5.7°" in result.text[-1]
    assert "°" not in measured(tuple(end[:2])).text[-1]
    assert "end_error_m" not in measured(None).figures


def test_files_and_the_page_hold_every_figure(run: LocalizedRecording, tmp_path: Path) -> None:
    result = seen(run)
    result.save("real-run", tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {
        "real-run.md",
        *(
            f"{name}{suffix}"
            for name in ("real-run-path", "real-run-overlay", "real-run-time")
            for suffix in (".png", ".svg")
        ),
    }
    page = html_report({"real-run": result}, SETTINGS)
    assert page.count("data:image/svg+xml;base64,") == 3
    assert page.count("<figcaption>Figure ") == 3
    assert 'src="http' not in page
    assert "quick run" in page
    assert result.tables[0].title in page
    assert "{&#x27;" not in page  # as of a dictionary
    for name in LocalizationConfig.model_fields:
        assert f"<td>{name}</td>" in page
