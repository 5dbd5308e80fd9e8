"""What a map forgets when later drives have shown the same places, so that a session grows with the places
and not with the drives, and shows them as they are now.

What goes is a keyframe that later drives passed: their scans are newer, and as good. Its constraints pass on
to the keyframes that stay. (Keeping the map of a changing place small by what scans are worth: Kretzschmar
and Stachniss, IJRR 2012; dropping the scans of what has changed: Walcott-Bryant et al., "Dynamic pose graph
SLAM", IROS 2012.)
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.mapping.graph.contraction import contracted
from racecar.mapping.keyframes.first_pass import ALIKE_TURN, NEAR
from racecar.mapping.session.coverage import showing_more
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import wrap_angle

_OUTDATED_AFTER = 2
"""Later drives near a keyframe, from which on what it saw is forgotten. By judgement: one could be misled by
people, two show what stays."""


def forget_outdated(session: Session) -> Session:
    """The session without the keyframes that enough later drives passed, but for those that alone show
    something: what lies behind a door that is closed since, or beyond the reach of a later laser."""
    is_left = _drives_later(session) < _OUTDATED_AFTER
    if is_left.all():
        return session
    is_left = showing_more(session.rays, session.map_from_keyframe, is_left)
    constraints = contracted(session.constraints, session.map_from_keyframe, is_left)
    return replace(session.only(is_left), constraints=constraints)


def _drives_later(session: Session) -> NDArray[np.int64]:
    """(K,) how many later drives passed each keyframe, and saw something there."""
    poses, drives = session.map_from_keyframe, session.drives.astype(np.int64)
    pairs = cKDTree(poses[:, :2]).query_pairs(NEAR, output_type="ndarray")
    pairs = np.take_along_axis(pairs, np.argsort(drives[pairs], axis=1), axis=1)
    earlier, later = pairs.T
    face_alike = np.abs(wrap_angle(poses[earlier, 2] - poses[later, 2])) < ALIKE_TURN
    shows = (drives[later] > drives[earlier]) & face_alike & session.keyframes.is_kept[later]
    passed = np.unique(np.column_stack([earlier[shows], drives[later[shows]]]), axis=0)
    return np.bincount(passed[:, 0], minlength=len(poses))
