from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.slam.false_loops import with_false_loops, wrong_loops
from racecar.mapping.graph.constraint import Constraint
from racecar.maps.geometry.se2 import between, compose
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.runs.evaluation.relations import Relations, relation_errors

LAP = 60
SCANS_PER_KEYFRAME = 3
INFORMATION = np.diag([1e4, 1e4, 4e4])


def circles(laps: int, radius: float) -> np.ndarray:
    angle = 2 * np.pi / LAP * np.arange(laps * LAP)
    return np.column_stack([radius * np.sin(angle), radius * (1 - np.cos(angle)), angle])


def constraint(poses: np.ndarray, a: int, b: int, kind: str, rng: np.random.Generator) -> Constraint:
    noise = rng.normal(0.0, [0.01, 0.01, 0.005])
    return Constraint(a, b, compose(between(poses[a], poses[b]), noise), INFORMATION, kind)


def loops_of(poses: np.ndarray, rng: np.random.Generator) -> list[Constraint]:
    return [constraint(poses, i, i + LAP, "loop_closure", rng) for i in range(0, len(poses) - LAP, 4)]


def mapped(poses: np.ndarray, rng: np.random.Generator) -> tuple[SimpleNamespace, Relations]:
    """What counts of a run whose poses are the truth, with two scans between keyframes; true relations."""
    between_keyframes = np.array([[0.1 * i, 0.02 * i, 0.03 * i] for i in range(SCANS_PER_KEYFRAME)])
    scans = compose(poses[:, None], between_keyframes).reshape(-1, 3)
    trajectory = Trajectory(np.arange(len(scans)) * 25_000_000, scans)
    steps = [constraint(poses, i, i + 1, "scan_matching", rng) for i in range(len(poses) - 1)]
    pairs = rng.integers(0, len(scans), (200, 2))
    relations = Relations(trajectory.stamps[pairs], between(scans[pairs[:, 0]], scans[pairs[:, 1]]))
    result = SimpleNamespace(
        trajectory=trajectory,
        keyframe_indices=np.arange(len(poses)) * SCANS_PER_KEYFRAME,
        constraints=[*steps, *loops_of(poses, rng)],
    )
    return result, relations


def test_wrong_loops_look_like_true_ones_but_are_far_off() -> None:
    poses, rng = circles(3, 10.0), np.random.default_rng(1)
    true = loops_of(poses, rng)
    wrong = wrong_loops(poses, true, np.random.default_rng(2))
    assert len(wrong) == len(true)
    measurements = {tuple(loop.from_pose_to_pose) for loop in true}
    for loop in wrong:
        assert loop.kind == "loop_closure"
        assert tuple(loop.from_pose_to_pose) in measurements
        np.testing.assert_array_equal(loop.information, INFORMATION)
        apart = between(poses[loop.from_keyframe], poses[loop.to_keyframe])
        assert np.hypot(*apart[:2]) > 5.0
        assert np.hypot(*between(loop.from_pose_to_pose, apart)[:2]) > 5.0
    again = wrong_loops(poses, true, np.random.default_rng(2))
    other = wrong_loops(poses, true, np.random.default_rng(3))
    pairs = [[(loop.from_keyframe, loop.to_keyframe) for loop in drawn] for drawn in (wrong, again, other)]
    assert pairs[0] == pairs[1] != pairs[2]


def test_there_are_none_without_true_ones_or_without_room() -> None:
    rng = np.random.default_rng(1)
    assert wrong_loops(circles(3, 10.0), [], rng) == []
    small = circles(3, 2.0)
    assert wrong_loops(small, loops_of(small, rng), rng) == []


def test_errors_before_and_after() -> None:
    poses = circles(3, 10.0)
    result, relations = mapped(poses, np.random.default_rng(4))
    figures = with_false_loops(result, relations, np.random.default_rng(5))
    assert figures.true_loops == figures.wrong_loops == 30
    assert 0.0 < figures.translation_before_m < 0.1
    assert 0.0 < figures.rotation_before_deg < 1.0
    assert figures.translation_after_m != figures.translation_before_m
    assert figures.translation_ratio == figures.translation_after_m / figures.translation_before_m
    assert figures.rotation_ratio == figures.rotation_after_deg / figures.rotation_before_deg


def test_scans_move_rigidly_with_the_keyframe_before_them() -> None:
    """Without noise and without loops the graph's solution is the truth, wherever the run's poses were."""
    poses = circles(1, 10.0)
    result, relations = mapped(poses, np.random.default_rng(6))
    steps = between(poses[:-1], poses[1:])
    exact = [Constraint(i, i + 1, step, INFORMATION, "scan_matching") for i, step in enumerate(steps)]
    bent = result.trajectory.map_from_base.copy().reshape(LAP, SCANS_PER_KEYFRAME, 3)
    shift = np.random.default_rng(7).normal(0.0, [0.05, 0.05, 0.02], (LAP, 3))
    bent = compose(compose(poses, shift)[:, None], between(poses[:, None], bent)).reshape(-1, 3)
    trajectory = Trajectory(result.trajectory.stamps, bent)
    assert relation_errors(trajectory, relations).summary()["translation_mean_m"] > 0.03
    run = SimpleNamespace(trajectory=trajectory, keyframe_indices=result.keyframe_indices, constraints=exact)
    figures = with_false_loops(run, relations, np.random.default_rng(8))
    assert figures.wrong_loops == 0
    assert figures.translation_before_m == figures.translation_after_m == pytest.approx(0.0, abs=1e-3)
