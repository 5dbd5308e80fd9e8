"""What holds the path together at each step."""

import numpy as np

from racecar.mapping.graph.constraint import Constraint, ConstraintList, Kind
from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.mapping.quality.step_ties import StepTies
from racecar.maps.geometry.se2 import between

POSES = np.column_stack([30.0 + 0.3 * np.arange(60), np.full(60, -20.0), np.full(60, 0.7)])


def tie(first: int, second: int, sigmas: tuple[float, float, float], kind: Kind) -> Constraint:
    information = np.diag(np.array(sigmas) ** -2.0)
    return Constraint(first, second, between(POSES[first], POSES[second]), information, kind)


def test_a_step_over_which_no_scan_match_leads_is_tied_by_the_wheels_only() -> None:
    scans = [
        tie(k - back, k, (0.01, 0.01, 0.002), "scan_matching")
        for k in range(1, 60)
        for back in (1, 2, 7)
        if back <= k and not k - back < 31 <= k
    ]
    wheels = [tie(k, k + 1, (0.05, 0.05, 0.02), "odometry") for k in range(59)]
    ties = StepTies.of(GraphEdges.of(ConstraintList([*scans, *wheels]), POSES), POSES)
    assert np.argmax(ties.by_scans) == 30
    assert ties.by_scans[30] > 5.0
    assert np.delete(ties.by_scans, 30).max() < 0.02
    assert 0.04 < ties.by_all[30] < 0.06


def test_along_a_corridor_the_worst_direction_counts() -> None:
    scans = [tie(k, k + 1, (2.0, 0.01, 0.002), "scan_matching") for k in range(59)]
    ties = StepTies.of(GraphEdges.of(ConstraintList(scans), POSES), POSES)
    assert np.all((ties.by_scans > 1.5) & (ties.by_scans < 2.1))


def test_a_loop_closure_across_a_step_does_not_tie_the_step() -> None:
    loop = [tie(0, 59, (0.01, 0.01, 0.002), "scan_matching")]
    assert StepTies.of(GraphEdges.of(ConstraintList(loop), POSES), POSES).by_scans.min() > 5.0
