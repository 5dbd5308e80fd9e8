"""Grades."""

import numpy as np
import pytest

from racecar.localization.config import LocalizationConfig
from racecar.pipelines.experiments.autograde import grade_drive, graded
from racecar.pipelines.experiments.page import COURSE_NAME, OURS_NAME
from racecar.pipelines.runs.evaluation.course_filter import CourseSettings
from racecar.pipelines.simulation.simulator_config import NoiseLevel, SimulationConfig


@pytest.mark.parametrize(
    ("ours", "reference", "grade", "ratio"),
    [(0.1, 0.1, 1.0, 1.0), (0.05, 0.1, 1.0, 2.0), (0.4, 0.1, 0.7, 0.25), (2.0, 0.1, 0.0, 0.05)],
)
def test_the_courses_grade_stops_at_one_and_the_ratio_does_not(
    ours: float, reference: float, grade: float, ratio: float
) -> None:
    runs = {
        name: {"deviation_m": np.array([metres]), "heading_deviation_deg": np.zeros(1)}
        for name, metres in ((OURS_NAME, ours), (COURSE_NAME, reference))
    }
    grades = graded(runs)
    assert grades["course_grade"].tolist() == pytest.approx([grade])
    assert grades["reference_over_ours"].tolist() == pytest.approx([ratio])


def test_both_filters_stay_with_the_truth_where_nothing_is_noisy() -> None:
    config = SimulationConfig(noise=NoiseLevel.NONE, range_noise=0.0, dropouts=0.0, duration=4.0)
    for variant in (LocalizationConfig(particles=500), CourseSettings()):
        measured = grade_drive(config, variant, 0)
        assert 0.0 < measured["deviation_m"] < 0.1
        assert measured["heading_deviation_deg"] < 1.15
        assert len(measured["errors_m"]) == 80
