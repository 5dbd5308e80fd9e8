import numpy as np

from racecar.mapping.mending.deformation import Deformation
from racecar.mapping.mending.manual_constraints import Moment, SamePlace
from racecar.mapping.mending.mender import Mender
from racecar.maps.geometry.se2 import compose, transform_points
from racecar.maps.trajectory import Trajectory
from tests.mapping.mending.bent import two_laps


def corrected() -> Deformation:
    mender = Mender(two_laps())
    mender.add(SamePlace(Moment(5.0), Moment(112.0)))
    return Deformation(two_laps(), mender.session())


def test_the_trajectory_stays_that_of_the_session() -> None:
    bent = corrected()
    stamps = bent.before.times.stamps
    between_keyframes = stamps[:-1] + 400_000_000
    moved = compose(bent.before.map_from_keyframe[:-1], np.array([0.12, 0.0, 0.0]))
    order = np.argsort(np.concatenate([stamps, between_keyframes]))
    trajectory = Trajectory(
        np.concatenate([stamps, between_keyframes])[order],
        np.concatenate([bent.before.map_from_base, moved])[order],
    )
    assert bent.before.is_of(trajectory)
    carried = bent.trajectory(trajectory)
    assert bent.after.is_of(carried)
    ahead = np.hypot(*(carried.map_from_base[1::2] - carried.map_from_base[:-1:2])[:, :2].T)
    np.testing.assert_allclose(ahead, 0.12, atol=0.01)


def test_places_move_with_the_keyframes_beside_them() -> None:
    bent = corrected()
    old, new = (each.map_from_keyframe[150] for each in (bent.before, bent.after))
    beside = np.array([[0.05, 0.02]])
    np.testing.assert_allclose(
        bent.places(transform_points(old, beside)), transform_points(new, beside), atol=1e-9
    )
    assert bent.places(np.zeros((0, 2))).shape == (0, 2)
