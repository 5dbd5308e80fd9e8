from pathlib import Path

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import between, compose
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.runs.evaluation.relations import Relations, load_relations, relation_errors

SECOND = 1_000_000_000


def drive(rng: np.random.Generator, count: int = 50) -> Trajectory:
    steps = rng.normal([0.3, 0.0, 0.05], [0.1, 0.01, 0.1], (count, 3))
    poses = np.zeros((count, 3))
    for i in range(1, count):
        poses[i] = compose(poses[i - 1], steps[i])
    return Trajectory(np.arange(count) * SECOND // 40 + 123, poses)


def relations_of(truth: Trajectory, pairs: np.ndarray) -> Relations:
    first, second = pairs.T
    return Relations(truth.stamps[pairs], between(truth.map_from_base[first], truth.map_from_base[second]))


def test_truth_has_no_error_in_any_map_frame() -> None:
    rng = np.random.default_rng(1)
    truth = drive(rng)
    relations = relations_of(truth, rng.integers(0, 50, (30, 2)))
    moved = Trajectory(truth.stamps, compose([5.0, -3.0, 2.0], truth.map_from_base))
    errors = relation_errors(moved, relations)
    assert errors.lost == 0
    assert len(errors.translations) == 30
    assert errors.translations.max() < 1e-12
    assert errors.rotations.max() < 1e-12


def test_a_known_error_is_measured() -> None:
    truth = drive(np.random.default_rng(2))
    relations = relations_of(truth, np.array([[3, 9], [20, 10]]))
    poses = truth.map_from_base.copy()
    poses[9] = compose(poses[9], [0.03, 0.04, np.deg2rad(-2)])
    summary = relation_errors(Trajectory(truth.stamps, poses), relations).summary()
    assert summary["translation_mean_m"] == pytest.approx(0.025)
    assert summary["translation_std_m"] == pytest.approx(0.025)
    assert summary["translation_mean_square_m2"] == pytest.approx(0.05**2 / 2)
    assert summary["rotation_mean_deg"] == pytest.approx(1.0)
    assert summary["rotation_mean_square_deg2"] == pytest.approx(2.0)
    assert summary["relations"] == 2


def test_rounded_stamps_match_and_absent_ones_are_lost() -> None:
    truth = drive(np.random.default_rng(3))
    relations = relations_of(truth, np.array([[0, 5], [5, 49], [7, 8]]))
    stamps = relations.stamps + np.array([[400, -400], [400, 2 * SECOND], [-SECOND, 0]])
    errors = relation_errors(truth, Relations(stamps, relations.first_from_second))
    assert errors.lost == 2
    assert errors.translations == pytest.approx([0.0], abs=1e-12)


def test_nothing_in_common() -> None:
    truth = drive(np.random.default_rng(4))
    later = Relations(truth.stamps[:2][None] + 100 * SECOND, np.zeros((1, 3)))
    with pytest.raises(UserError, match="None of the 1 relations"):
        relation_errors(truth, later)
    alone = Trajectory(truth.stamps[:1], truth.map_from_base[:1])
    with pytest.raises(UserError, match="None of the 1 relations"):
        relation_errors(alone, later)


def test_files(tmp_path: Path) -> None:
    path = tmp_path / "some.relations"
    path.write_text("90.239599 90.719599 0.42 -0.01 0 0 0 0.5\n")
    relations = load_relations(path)
    assert relations.stamps.tolist() == [[90239599000, 90719599000]]
    np.testing.assert_array_equal(relations.first_from_second, [[0.42, -0.01, 0.5]])
    for text, complaint in [("", "no relations"), ("\n1 2 3", "line 2 of"), ("1 2 3 4 5 6 7 x", "line 1 of")]:
        path.write_text(text)
        with pytest.raises(UserError, match=complaint):
            load_relations(path)


@pytest.mark.parametrize(("log", "count"), [("aces", 1279), ("fr079", 1685), ("intel", 2984)])
def test_the_benchmarks_files(recordings: Path, log: str, count: int) -> None:
    assert len(load_relations(recordings / "slam_benchmark" / f"{log}.relations")) == count
