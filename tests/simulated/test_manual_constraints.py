"""Maps of a simulated building with a missing and a wrong loop, corrected by what the verdict lists."""

from dataclasses import replace

import numpy as np
import pytest
from evo.core.geometry import umeyama_alignment

from racecar.mapping.config import MappingConfig
from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.mapper import Mapper
from racecar.mapping.mending.manual_constraints import Moment, NotSamePlace, SamePlace
from racecar.mapping.mending.mender import Mender
from racecar.mapping.mending.refused import RefusedConstraintError
from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.judgement import judge
from racecar.mapping.quality.map_quality import DoubtfulSegment, Verdict
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import IDENTITY, Pose, between
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import LaserKind, NoiseLevel, SimulationConfig

SECONDS = 240.0
MOST_CONSTRAINTS = 4
"""Two for each of two faults."""
ONE_PLACE = 2.5
"""Metres between two true poses of a place that a user sees is one."""


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_the_list_leads_to_a_missing_and_a_wrong_loop_and_two_constraints_correct_each(seed: int) -> None:
    config = SimulationConfig(seed=seed, duration=SECONDS, noise=NoiseLevel.FULL, laser=LaserKind.ROUND)
    simulation = Simulation(load_map(shipped_map("building")), config)
    messages = list(simulation.messages())
    right, open_ = (_mapped(messages, close_loops=closes).session for closes in (True, False))
    truth = simulation.ground_truth
    true = truth.map_from_base[np.searchsorted(truth.stamps, right.times.stamps)]
    wrong = _with_wrong_loop(open_, true, np.random.default_rng(seed))
    mender = Mender(wrong)
    for _ in range(MOST_CONSTRAINTS):
        corrected = mender.session()
        quality = judge(FinishedMap(corrected), QualityConfig())
        if quality.verdict == Verdict.GOOD:
            break
        assert _follow(quality.segments, mender, corrected, true)
    print(seed, *(round(_error(each, true), 4) for each in (right, open_, wrong, mender.session())))
    assert _error(mender.session(), true) < _error(right, true) + 0.01


def _mapped(messages, *, close_loops: bool):
    mapper = Mapper(MappingConfig(close_loops=close_loops))
    for message in messages:
        feed(message, mapper)
    return mapper.finish()


def _with_wrong_loop(session: Session, true: Pose, random: np.random.Generator) -> Session:
    """Bent by a loop closure between two passes that are metres apart."""
    count = len(true)
    while True:
        first, second = int(random.integers(5, count // 2)), int(random.integers(count // 2, count - 10))
        apart = between(true[first], true[second])
        if 3.0 < np.hypot(apart[0], apart[1]) < 6.0 and abs(apart[2]) < 0.3:
            break
    information = np.diag([1e4, 1e4, 1e5])
    forced = [Constraint(first + k, second + k, IDENTITY, information, "manual") for k in range(0, 10, 2)]
    known = list(session.constraints)
    poses = PoseGraph(_sorted([*known, *forced])).optimize(session.map_from_keyframe)
    loops = [replace(each, kind="loop_closure") for each in forced]
    return replace(
        session, map_from_keyframe=poses, constraints=PoseGraph(_sorted([*known, *loops])).constraints
    )


def _sorted(constraints: list[Constraint]) -> list[Constraint]:
    return sorted(constraints, key=lambda each: each.to_keyframe)


def _follow(segments: tuple[DoubtfulSegment, ...], mender: Mender, session: Session, true: Pose) -> bool:
    """Answer the first question that the list asks; returns whether one was accepted."""
    seconds = session.times.seconds
    for segment in segments:
        if segment.contradicted_by is None:
            continue
        first, second = (int(np.mean(run)) for run in (segment.contradicted_by, segment.keyframes))
        moments = Moment(float(seconds[first])), Moment(float(seconds[second]))
        is_one = np.hypot(*between(true[first], true[second])[:2]) < ONE_PLACE
        try:
            mender.add((SamePlace if is_one else NotSamePlace)(*moments))
        except RefusedConstraintError as refused:
            if refused.instead is None:
                continue
            mender.add(NotSamePlace(*refused.instead))
        return True
    return False


def _error(session: Session, true: Pose) -> float:
    """Root mean square distance in metres of the best alignment."""
    places = session.map_from_base[:, :2]
    turn, shift, _ = umeyama_alignment(places.T, true[:, :2].T)
    return float(np.sqrt(np.mean(np.sum((places @ turn.T + shift - true[:, :2]) ** 2, axis=1))))
