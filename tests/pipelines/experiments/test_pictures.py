"""The figures of the experiments that need no sweep, and what every figure must be."""

import re
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from racecar.localization.config import LocalizationConfig
from racecar.pipelines.experiments.beams_and_particles import weighed_up
from racecar.pipelines.experiments.experiment import Experiment, ExperimentSettings
from racecar.pipelines.experiments.motion_model import motion_model
from racecar.pipelines.experiments.page import Page
from racecar.pipelines.experiments.sensor_model import sensor_model
from racecar.pipelines.runs.parallel_runs import ParallelRuns

SETTINGS, SWEEP = ExperimentSettings(LocalizationConfig(), 0, quick=True), ParallelRuns(quiet=True)
MILLIMETRE = 300 / 25.4


def pairs_weighed_up(settings: ExperimentSettings, _: ParallelRuns) -> Page:
    errors = np.linspace(0.01, 0.03, 2 * 3 * 2).reshape(2, 3, 2)
    figures = {
        "beams": (25, 400),
        "particles": (200, 2000, 20_000),
        "errors_m": errors,
        "leads_m": errors[::-1],
        "scatters_m": errors / 2,
        "measured_times": {"milliseconds_per_update": 1 + 10 * errors[..., 0]},
    }
    return weighed_up(figures, settings.localization)


@pytest.fixture(scope="module", params=[sensor_model, motion_model, pairs_weighed_up])
def experiment(request: pytest.FixtureRequest) -> Experiment:
    return request.param


@pytest.fixture(scope="module")
def result(experiment: Experiment) -> Page:
    return experiment(SETTINGS, SWEEP)


def test_figures_are_as_wide_as_a_column(result: Page) -> None:
    for picture in result.pictures:
        width, height = Image.open(BytesIO(picture.png)).size
        assert width == pytest.approx(85 * MILLIMETRE, abs=2)
        assert height < 160 * MILLIMETRE
        assert picture.svg.lstrip().startswith(b"<?xml")
        assert len(picture.shows) > 30


def test_the_same_figures_are_the_same_bytes(experiment: Experiment, result: Page) -> None:
    for first, second in zip(result.pictures, experiment(SETTINGS, SWEEP).pictures, strict=True):
        assert first.png == second.png
        assert first.svg == second.svg


def test_texts_are_whole(result: Page) -> None:
    assert not re.search(r"[{}]", " ".join(result.text))


def test_tables_are_whole_and_name_their_units(result: Page) -> None:
    assert all(result.text)
    for table in result.tables:
        assert all(len(row) == len(table.columns) for row in table.rows)
        words = f"{table.title} {' '.join(table.columns)}"
        assert re.search(r"\((m|cm|px|ms|s|°)[),]|P\(", words), words


def test_a_legend_lies_outside_the_axes() -> None:
    page = Page("Title")
    with page.draw("name", 60, "shows", legend_columns=2) as figure:
        axes = figure.subplots()
        axes.plot([0, 1], [0, 1], label="a")
    figure.draw_without_rendering()
    assert figure.legends[0].get_window_extent().y1 <= axes.get_window_extent().y0
    assert [(picture.name, picture.shows) for picture in page.pictures] == [("name", "shows")]


def test_only_noise_spreads_particles() -> None:
    figures = motion_model(SETTINGS, SWEEP).figures
    assert max(figures["without noise"]["deviation_m"]) < 1e-3
    spread = figures["with noise"]["deviation_m"]
    assert spread[0] < 1e-3 < 0.02 < spread[1] < spread[-1]
