"""Trim the state of a mapper, so that memory grows with places and not with hours: scans between keyframes
once they are placed, and keyframes once earlier ones show their places well enough (Kretzschmar and
Stachniss, IJRR 2012)."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping import schedule
from racecar.mapping.grid.rendering import Rays
from racecar.mapping.keyframes.known_places import matches_with_known
from racecar.mapping.state.mapper_state import MapperState
from racecar.mapping.state.scan_poses import place_scans
from racecar.maps.geometry.se2 import between, compose

_DELAY = 200
"""Keyframes after which one may be trimmed, since by then its loops are closed. Chosen by judgement: some 60
m of path, as far as loop closures wait for consistent support."""
_KEYFRAMES = 1500
"""Keyframes up to which none is trimmed, since each pass through a place improves the map slightly: some 450
m of path."""
_SCANS = 6000
"""Scans between keyframes kept for final refinement at most; each keyframe takes the room of two. Those
placed earlier, among nearly final keyframes, are some tenths of a millimetre worse. Measured: aces, fr079 and
intel were 0.0344, 0.0399 and 0.0134 m instead of 0.0344, 0.0399 and 0.0133 m."""


def trim_scans(state: MapperState, index: int) -> None:
    """Trim the earliest scans that are long before keyframe ``index`` and exceed the room.

    If keyframes are to be trimmed, so are scans of the latest ones: otherwise hundreds would go at once.
    """
    drive, until = state.drive, index - _DELAY
    kept, keyframes_kept = drive.kept_scans, int(np.sum(state.keyframes.is_kept))
    keyframes = drive.keyframe_of(kept)
    too_many = max(len(kept) - max(_SCANS - 2 * keyframes_kept, 0), 0)
    goes = keyframes < np.append(keyframes, until)[too_many]
    if keyframes_kept > _KEYFRAMES:
        goes |= keyframes >= until - schedule.WINDOW_INTERVAL
    _trim_scans(state, kept[goes & (keyframes < until)])


def trim_known_keyframes(state: MapperState, index: int) -> None:
    """Trim recent keyframes, long before keyframe ``index``, whose place earlier ones show well enough."""
    until = index - _DELAY
    first = max(until - schedule.PACKING_INTERVAL, 0)
    candidates = np.arange(first, max(until, 0))
    is_room_left = np.sum(state.keyframes.is_kept) <= _KEYFRAMES
    knows_places = state.config.close_loops and len(state.loops.history.submaps) > 0
    if len(candidates) == 0 or is_room_left or not knows_places:
        return
    with state.timed("scan matching"):
        matches = matches_with_known(candidates, state.map_from_keyframe, state.loops)
    if not matches:
        return
    with state.timed("optimization"):
        extended = state.graph.followed_by(matches)
        solved = extended.optimize_since(state.map_from_keyframe[:until], first)
        last_from_later = between(state.map_from_keyframe[until - 1], state.map_from_keyframe[until:])
        state.map_from_keyframe = np.concatenate([solved, compose(solved[-1], last_from_later)])
        state.graph = extended
    _trim_keyframes(state, np.array([match.to_keyframe for match in matches]))
    state.graph.trim(state.keyframes.is_kept, first)


def _trim_keyframes(state: MapperState, keyframes: NDArray[np.int64]) -> None:
    """Drop the scans of some keyframes and those after each."""
    kept = state.drive.kept_scans
    _trim_scans(state, kept[np.isin(state.drive.keyframe_of(kept), keyframes)])
    state.keyframes.trim(keyframes)
    for keyframe in keyframes.tolist():
        state.rays[keyframe] = Rays.none()
        if state.clouds is not None:
            state.clouds.pop(keyframe, None)


def _trim_scans(state: MapperState, scans: NDArray[np.int64]) -> None:
    """Place some scans between keyframes, then drop them."""
    if len(scans) > 0:
        lasers = np.array(state.drive.lasers)[scans].tolist()
        map_from_scan = state.reckoning.mounts.to_reference(place_scans(state, scans), lasers)
        state.drive.trim(scans, map_from_scan, state.map_from_reference)
