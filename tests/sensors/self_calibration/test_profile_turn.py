import numpy as np
import pytest

from racecar.sensors.self_calibration.profile_turn import bearing_profile, turn_between
from tests.sensors.worlds import ROOM, points_at


def profile(x: float, y: float, yaw: float) -> np.ndarray:
    return bearing_profile(points_at(ROOM, np.array([x, y, yaw])))


@pytest.mark.parametrize("turn", [-0.7, -0.2, 0.0, 0.35, 0.75])
def test_the_turn_is_found_from_a_wrong_guess(turn: float) -> None:
    found = turn_between(profile(0.0, 0.0, 0.3), profile(0.1, 0.05, 0.3 + turn), -turn)
    assert found == pytest.approx(turn, abs=0.03)


def test_a_guess_that_fits_stays() -> None:
    assert turn_between(profile(0.0, 0.0, 0.0), profile(0.0, 0.0, 0.2), 0.204) == 0.204


def test_without_points_the_guess_stays() -> None:
    nothing = bearing_profile(np.zeros((0, 2)))
    assert turn_between(nothing, profile(0.0, 0.0, 0.0), 0.1) == 0.1
