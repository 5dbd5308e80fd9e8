"""Poses of the scans between keyframes."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.keyframes.refinement import refine_scans
from racecar.mapping.session.session import Session
from racecar.mapping.state.mapper_state import MapperState
from racecar.maps.geometry.se2 import Pose


def place_all_scans(state: MapperState, session: Session) -> Pose:
    """map_from_laser (N, 3) of every scan, given the keyframes of all drives; those of this one are the
    last."""
    map_from_keyframe = session.map_from_keyframe[_first(state, session) :]
    map_from_laser = state.guess_scans(np.arange(len(state.drive)), map_from_keyframe)
    map_from_laser[np.array(state.drive.keyframe_scans)] = map_from_keyframe
    kept = state.drive.kept_scans
    map_from_laser[kept] = _refined(state, kept, map_from_laser[kept], session)
    return map_from_laser


def place_scans(state: MapperState, scans: NDArray[np.int64]) -> Pose:
    """map_from_laser (M, 3) of some scans (M,), given the keyframes so far."""
    guesses = state.guess_scans(scans, state.map_from_keyframe)
    return _refined(state, scans, guesses, state.session())


def _refined(state: MapperState, scans: NDArray[np.int64], guesses: Pose, session: Session) -> Pose:
    """Refined poses of scans (M,) from guesses (M, 3); the guesses themselves if refinement is off."""
    if not state.config.refine:
        return guesses
    with state.timed("refinement"):
        return refine_scans(
            [state.drive.clouds[scan] for scan in scans],
            _first(state, session) + state.drive.keyframe_of(scans),
            guesses,
            session.keyframes,
            session.map_from_keyframe,
        )


def _first(state: MapperState, session: Session) -> int:
    """Index of this drive's first keyframe among those of all drives."""
    return len(session.keyframes) - len(state.keyframes)
