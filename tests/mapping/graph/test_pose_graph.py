"""The pose graph shares out the drift of odometry, and ignores a false loop closure."""

import numpy as np
import pytest

from racecar.mapping.graph import pose_graph
from racecar.mapping.graph.coarse_graph import Groups
from racecar.mapping.graph.constraint import Constraint, Kind
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose


def circle(count: int = 60) -> Pose:
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    return np.column_stack([10 * np.cos(angle), 10 * np.sin(angle), np.angle(1j * np.exp(1j * angle))])


def groups(count: int) -> Groups:
    return Groups(np.arange(2, count, 5), np.arange(float(count)))


def constraint(a: int, b: int, pose: Pose, sigma: float, kind: Kind) -> Constraint:
    return Constraint(a, b, pose, np.eye(3) / sigma**2, kind)


def drifted(count: int = 60) -> tuple[PoseGraph, Pose, Pose]:
    """A graph of wheels that turn too far all the time; the poses (K, 3) by them, and the true ones."""
    true = circle(count)
    graph, poses = PoseGraph(), [true[0]]
    for k in range(1, len(true)):
        step = between(true[k - 1], true[k]) + np.array([0.0, 0.0, 0.005])
        graph.add(constraint(k - 1, k, step, 0.02, "odometry"))
        poses.append(compose(poses[-1], step))
    return graph, np.array(poses), true


def largest_error(poses: Pose, true: Pose) -> float:
    return float(np.hypot(*(poses - true)[:, :2].T).max())


def test_a_loop_closure_takes_the_drift_out() -> None:
    graph, poses, true = drifted()
    before = largest_error(poses, true)
    graph.add(constraint(0, 59, between(true[0], true[59]), 0.01, "loop_closure"))
    assert before > 1.0
    assert largest_error(graph.optimize(poses), true) < 0.3 * before


def test_false_loop_closures_are_ignored() -> None:
    graph, poses, true = drifted()
    for a, b in ((0, 59), (2, 58), (4, 57), (1, 56)):
        graph.add(constraint(a, b, between(true[a], true[b]), 0.01, "loop_closure"))
    clean = largest_error(graph.optimize(poses), true)
    graph.add(constraint(10, 40, np.array([1.0, -2.0, 0.5]), 0.01, "loop_closure"))
    assert largest_error(graph.optimize(poses), true) < clean + 0.2


def turned_too_far(*matched: Constraint) -> tuple[PoseGraph, Pose, Pose]:
    """A graph whose wheels turn by 0.1 rad too far at keyframe 3, and which only what is ``matched`` beside
    ties to those before; the poses (K, 3) by the wheels, and the true ones."""
    true = circle(24)
    graph, poses = PoseGraph(matched), [true[0]]
    for k in range(1, len(true)):
        step = between(true[k - 1], true[k]) + np.array([0.0, 0.0, 0.1 * (k == 3)])
        poses.append(compose(poses[-1], step))
        graph.add(constraint(k - 1, k, step, 0.01, "odometry"))
        for a in range(max(k - 4, 3), k):
            graph.add(constraint(a, k, between(true[a], true[k]), 0.001, "scan_matching"))
    return graph, np.array(poses), true


def matched(a: int, b: int, off: Pose = IDENTITY) -> Constraint:
    true = circle(24)
    return constraint(a, b, compose(between(true[a], true[b]), off), 0.001, "scan_matching")


def test_matches_that_agree_outvote_wheels() -> None:
    graph, poses, true = turned_too_far(matched(0, 4), matched(1, 5), matched(2, 6))
    assert largest_error(poses, true) > 1.0
    assert largest_error(graph.optimize(poses), true) < 0.02


def test_a_match_that_stands_alone_does_not() -> None:
    graph, poses, _ = turned_too_far(matched(1, 20, np.array([1.0, 0.5, 0.5])))
    np.testing.assert_allclose(graph.optimize(poses), poses, atol=0.05)


def test_fixed_keyframes_stay_and_pull_the_others() -> None:
    graph, poses, true = drifted()
    poses[:40] = true[:40]
    graph.add(constraint(0, 59, between(true[0], true[59]), 0.01, "loop_closure"))
    solved = graph.optimize_roughly(poses, 40)
    np.testing.assert_array_equal(solved[:40], true[:40])
    assert largest_error(poses, true) > 1.0
    assert largest_error(solved, true) < 0.1


def test_a_keyframe_that_nothing_ties_to_others_stays() -> None:
    true = circle(8)
    graph = PoseGraph()
    for k in (1, 2, 3, 5):
        graph.add(constraint(k - 1, k, between(true[k - 1], true[k]), 0.02, "scan_matching"))
    drifted = true + 0.01 * np.arange(8)[:, None]
    found = graph.optimize(drifted)
    assert np.allclose(found[:4], compose(found[0], between(true[0], true[:4])), atol=1e-3)
    assert np.allclose(found[6:], drifted[6:])


def test_a_loop_moves_only_what_is_not_tied_yet_when_that_is_enough() -> None:
    graph, poses, true = drifted()
    poses[:40] = true[:40]
    loop = constraint(0, 59, between(true[0], true[59]), 0.01, "loop_closure")
    solved = graph.close([loop], poses, groups(60), 40)
    np.testing.assert_array_equal(solved[:40], true[:40])
    assert largest_error(solved, true) < 0.1


def test_a_loop_that_strains_what_was_tied_moves_that_too() -> None:
    graph, poses, true = drifted()
    loop = constraint(0, 50, between(true[0], true[50]), 0.01, "loop_closure")
    solved = graph.close([loop], poses, groups(60), 55)
    assert not np.allclose(solved[1:50], poses[1:50])
    assert largest_error(solved, true) < 0.3 * largest_error(poses, true)


def test_a_loop_that_fits_moves_nothing() -> None:
    graph, poses, _ = drifted()
    loop = constraint(0, 59, between(poses[0], poses[59]), 0.01, "loop_closure")
    np.testing.assert_array_equal(graph.close([loop], poses, groups(60)), poses)


def test_a_loop_moves_a_long_drive_by_groups_and_its_end_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pose_graph, "_MOST_SOLVED_SINGLY", 40)
    graph, poses, true = drifted(200)
    exact, _, _ = drifted(200)
    loop = constraint(2, 197, between(true[2], true[197]), 0.01, "loop_closure")
    exact.add(loop)
    expected = exact.optimize(poses)
    solved = graph.close([loop], poses, groups(200))
    assert largest_error(expected, poses) > 1.0
    assert largest_error(solved, expected) < 0.1


def test_of_the_first_keyframes_alone_the_later_ones_do_not_count() -> None:
    graph, poses, true = drifted()
    poses[:20] = true[:20]
    graph.add(constraint(0, 40, between(true[0], true[40]), 0.01, "loop_closure"))
    graph.add(constraint(10, 55, np.zeros(3), 0.001, "scan_matching"))
    solved = graph.optimize_since(poses[:41], 20)
    assert len(solved) == 41
    np.testing.assert_array_equal(solved[:20], poses[:20])
    assert largest_error(solved[40:], true[40:41]) < 0.1 < largest_error(poses[40:41], true[40:41])


def test_constraints_between_trimmed_keyframes_are_thinned_out() -> None:
    true = circle()
    graph = PoseGraph(
        (
            constraint(k - back, k, between(true[k - back], true[k]), 0.01, kind)
            for k in range(1, 60)
            for back, kind in ((1, "scan_matching"), (3, "scan_matching"), (1, "odometry"))
            if back <= k
        ),
    )
    for k in range(30, 40):
        graph.add(constraint(5, k, between(true[5], true[k]), 0.01, "scan_matching"))
    graph.add(constraint(31, 36, between(true[31], true[36]), 0.01, "loop_closure"))
    is_kept = (np.arange(60) < 30) | (np.arange(60) >= 40)
    graph.trim(is_kept, 30)
    left = [(c.from_keyframe, c.to_keyframe, c.kind) for c in graph.constraints]
    assert [to for _, to, _ in left] == sorted(to for _, to, _ in left)
    within = [each for each in left if not is_kept[each[0]] and not is_kept[each[1]]]
    neighbours = [(k - 1, k, "scan_matching") for k in range(31, 40)]
    assert sorted(within) == sorted([*neighbours, (31, 36, "loop_closure")])
    assert len(left) == 59 + 57 + 59 + 10 + 1 - 9 - 7
    bent = true + np.random.default_rng(0).normal(0.0, 0.02, true.shape)
    bent[0] = true[0]
    assert largest_error(graph.optimize(bent), true) < 0.002
    assert largest_error(graph.optimize_since(true, 20), true) < 0.002


@pytest.mark.parametrize(("limit", "is_left"), [(0.3, False), (100.0, True)])
def test_a_closure_that_the_solution_refutes_is_dropped_in_the_end(
    limit: float, is_left: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pose_graph, "_REFUTED", (limit, 10.0))
    graph, poses, true = drifted()
    for a, b in ((0, 59), (2, 58), (4, 57), (1, 56)):
        graph.add(constraint(a, b, between(true[a], true[b]), 0.01, "loop_closure"))
    graph.add(constraint(10, 40, np.array([1.0, -2.0, 0.5]), 0.01, "loop_closure"))
    graph.optimize_finally(poses)
    closures = [(c.from_keyframe, c.to_keyframe) for c in graph.constraints if c.kind == "loop_closure"]
    assert ((10, 40) in closures) == is_left
    assert len(closures) == 4 + is_left
