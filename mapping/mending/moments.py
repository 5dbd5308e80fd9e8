"""The keyframes of moments."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.loops.submap import Submap
from racecar.mapping.loops.submap_graph import HALF_LENGTH
from racecar.mapping.mending.manual_constraints import Moment
from racecar.mapping.mending.refused import RefusedConstraintError
from racecar.mapping.session.session import Session
from racecar.maps.geometry.polyline import lengths_along
from racecar.maps.geometry.se2 import Pose

_BEYOND = 1.0
"""Seconds that a moment may lie outside of its recording, because people round."""


def keyframe_at(moment: Moment, session: Session) -> int:
    """The keyframe nearest in time whose scan is kept. Raises RefusedConstraintError when there is none."""
    times = session.times
    number, count = moment.recording or 0, len(times.recordings)
    if moment.recording is None and count > 1:
        raise RefusedConstraintError(
            f"The map was made of {count} recordings: say by its number in which {moment.seconds:.1f} s lies."
        )
    if not 0 <= number < count:
        raise RefusedConstraintError(f"The map has no recording {number + 1}: it was made of {count}.")
    recording = times.recordings[number]
    lasts = (recording.end - recording.begin) * 1e-9
    if not -_BEYOND <= moment.seconds <= lasts + _BEYOND:
        raise RefusedConstraintError(
            f"There is no moment {moment.seconds:.1f} s in the recording, which lasts {lasts:.1f} s."
        )
    known = np.flatnonzero((times.numbers == number) & session.keyframes.is_kept)
    if len(known) == 0:
        raise RefusedConstraintError(f"No scan of recording {number + 1} remains in the map.")
    return int(known[np.argmin(np.abs(times.seconds[known] - moment.seconds))])


def keyframes_between(begin: Moment, end: Moment, session: Session) -> NDArray[np.bool_]:
    """(K,) whether a keyframe lies between two moments of one recording, or is the nearest to one of them.
    Raises RefusedConstraintError as above."""
    first, last = (keyframe_at(moment, session) for moment in (begin, end))
    keyframes = np.arange(len(session.times.stamps))
    return np.asarray((keyframes >= first) & (keyframes <= last))


def submap_about(keyframe: int, session: Session, poses: Pose) -> Submap:
    """The keyframes of its recording within some metres of path of a keyframe, at ``poses`` (K, 3)."""
    path, numbers = lengths_along(poses[:, :2]), session.times.numbers
    near = (np.abs(path - path[keyframe]) < HALF_LENGTH) & (numbers == numbers[keyframe])
    near &= session.keyframes.is_kept
    first, last = keyframe, keyframe
    while first > 0 and near[first - 1]:
        first -= 1
    while last + 1 < len(near) and near[last + 1]:
        last += 1
    return Submap(-1, first, keyframe, last)
