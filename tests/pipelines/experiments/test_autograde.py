"""Grades."""

import numpy as np
import pytest

from racecar.localization.config import LocalizationConfig
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.experiments.autograde import GradedDrive, Grades, grade_drive
from racecar.pipelines.experiments.figure_style import COURSE_NAME, OURS_NAME
from racecar.pipelines.runs.evaluation.course_filter import CourseSettings
from racecar.pipelines.simulation.simulator_config import NoiseLevel, SimulationConfig


@pytest.mark.parametrize(
    ("ours", "reference", "grade", "ratio"),
    [(0.1, 0.1, 1.0, 1.0), (0.05, 0.1, 1.0, 2.0), (0.4, 0.1, 0.7, 0.25), (2.0, 0.1, 0.0, 0.05)],
)
def test_the_courses_grade_stops_at_one_and_the_ratio_does_not(
    ours: float, reference: float, grade: float, ratio: float
) -> None:
    path = np.zeros((2, 3))
    drives = {OURS_NAME: [GradedDrive(path, ours, 0.0)], COURSE_NAME: [GradedDrive(path, reference, 0.0)]}
    grades = Grades(drives, Trajectory(np.array([0, 1]), path))
    assert grades.of_the_course.tolist() == pytest.approx([grade])
    assert grades.ratios.tolist() == pytest.approx([ratio])


def test_both_filters_stay_with_the_truth_where_nothing_is_noisy() -> None:
    config = SimulationConfig(noise=NoiseLevel.NONE, range_noise=0.0, dropouts=0.0, duration=4.0)
    for variant in (LocalizationConfig(particles=500), CourseSettings()):
        drive = grade_drive(config, variant, 0)
        assert 0.0 < drive.deviation < 0.1
        assert drive.heading_deviation < 0.02
        assert len(drive.map_from_base) == 80
