"""The parts of mapping that an ablation leaves out, by name, with their replacements.

Not listed are parts that only save time or memory, and those that correct a recording before it is mapped.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.variant import (
    LOOPS_NOT_SEEN_THROUGH,
    LOOPS_NOT_SUPPORTED,
    Variant,
    nothing,
    replacing,
)
from racecar.mapping import schedule
from racecar.mapping.graph import pose_graph
from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.keyframes import final_optimization
from racecar.mapping.keyframes.misled_matches import MatchesAlongPath
from racecar.mapping.keyframes.placement import KeyframePlacer
from racecar.mapping.state.mapper_state import MapperState
from racecar.maps.geometry.se2 import Pose
from racecar.sensors.motion import dead_reckoning
from racecar.sensors.motion.dead_reckoning import DeadReckoning
from racecar.sensors.motion.lag import OdometryLag
from racecar.sensors.motion.motion_guesses import GuessSource, MotionGuesses
from racecar.sensors.motion.velocity_filter import VelocityFilter

_GUESSES = DeadReckoning.guesses
"""The original method."""


def _no(*_: object, **__: object) -> bool:
    """Replaces a predicate."""
    return False


def _none(*_: object) -> list[object]:
    """Replaces a search."""
    return []


def _no_step(matches: MatchesAlongPath) -> NDArray[np.bool_]:
    """Replaces the steps in which scans mislead."""
    return np.zeros(len(matches.steps), dtype=np.bool_)


def _no_pairs(*_: object) -> NDArray[np.int64]:
    """Replaces pairs of keyframes."""
    return np.zeros((0, 2), dtype=np.int64)


def _as_predicted(_last: object, _points: object, motion: Pose) -> Pose:
    """Replaces the search for a turn."""
    return motion


def _as_it_is(constraint: Constraint, _: Pose) -> Constraint:
    """Replaces the loosening of a constraint."""
    return constraint


def _without_scan_odometry(reckoning: DeadReckoning) -> MotionGuesses:
    """Replaces the guesses if wheels or the filter make one."""
    guesses = _GUESSES(reckoning)
    has_other = GuessSource.WHEELS_OR_FILTER in guesses.by
    return guesses.without(GuessSource.SCAN_ODOMETRY) if has_other else guesses


def _without_steady_velocity(reckoning: DeadReckoning) -> MotionGuesses:
    """Replaces the guesses."""
    return _GUESSES(reckoning).without(GuessSource.STEADY_VELOCITY)


PARTS: Mapping[str, Variant] = {
    "refinement": Variant({"refine": False}),
    "loop closure": Variant({"close_loops": False}),
    "calibration of the wheels": replacing(MapperState, calibrate=nothing),
    "lag of the wheels": replacing(OdometryLag, learn=_no),
    "wheels that hang": replacing(DeadReckoning, _leave_out_wheels=nothing),
    "guess by scan odometry": replacing(DeadReckoning, guesses=_without_scan_odometry),
    "guess by steady velocity": replacing(DeadReckoning, guesses=_without_steady_velocity),
    "velocity filter": replacing(VelocityFilter, advance=_no),
    "search for turns": replacing(dead_reckoning, with_turn_seen=_as_predicted),
    "search for lost keyframes": replacing(KeyframePlacer, _search=_none),
    "see-through test of loops": LOOPS_NOT_SEEN_THROUGH,
    "support of loops": LOOPS_NOT_SUPPORTED,
    "ties to the first pass": replacing(final_optimization, pairs_with_first_pass=_no_pairs),
    "matches that are misled": replacing(MatchesAlongPath, misled_steps=_no_step),
    "loose wheels where refuted": replacing(Constraint, loosened=_as_it_is),
    "annealed matches": replacing(pose_graph, _WIDEST_MATCH_LOSS=pose_graph._LOSS_WIDTHS[-1]),
    "rounds at the end but one": replacing(schedule, FINAL_ROUNDS=1),
}
