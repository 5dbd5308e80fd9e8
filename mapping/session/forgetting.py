"""Forget keyframes that later drives replace, so that a session grows with places and not with drives, and
shows places as they are now.

A keyframe is removed when later drives passed it: their scans are newer, and as good. Its constraints pass on
to the remaining keyframes. (Keeping the map of a changing place small by the information in scans:
Kretzschmar and Stachniss, IJRR 2012; dropping the scans of what has changed: Walcott-Bryant et al., "Dynamic
pose graph SLAM", IROS 2012.)
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
"""Number of later drives near a keyframe after which it is forgotten. Chosen by judgement: one could be
misled by people, two show what stays."""


def forget_outdated(session: Session) -> Session:
    """The session without keyframes that enough later drives passed, except those that alone show something:
    behind a door that is now closed, or beyond the range of a later laser."""
    remains = _drives_later(session) < _OUTDATED_AFTER
    if remains.all():
        return session
    remains = showing_more(session.rays, session.map_from_keyframe, remains)
    constraints = contracted(session.constraints, session.map_from_keyframe, remains)
    return replace(session.only(remains), constraints=constraints)


def _drives_later(session: Session) -> NDArray[np.int64]:
    """(K,) number of later drives that passed each keyframe and saw something there."""
    poses, drives = session.map_from_keyframe, session.drives.astype(np.int64)
    pairs = cKDTree(poses[:, :2]).query_pairs(NEAR, output_type="ndarray")
    pairs = np.take_along_axis(pairs, np.argsort(drives[pairs], axis=1), axis=1)
    earlier, later = pairs.T
    face_alike = np.abs(wrap_angle(poses[earlier, 2] - poses[later, 2])) < ALIKE_TURN
    shows = (drives[later] > drives[earlier]) & face_alike & session.keyframes.is_kept[later]
    passed = np.unique(np.column_stack([earlier[shows], drives[later[shows]]]), axis=0)
    return np.bincount(passed[:, 0], minlength=len(poses))
