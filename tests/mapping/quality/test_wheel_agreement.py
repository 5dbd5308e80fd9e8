"""Wheels against the finished map."""

import numpy as np
import pytest

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.mapping.quality.wheel_agreement import wheel_agreement
from racecar.maps.geometry.se2 import between

STRAIGHT = np.column_stack([0.5 * np.arange(21), np.zeros(21), np.zeros(21)])
PATH = STRAIGHT[:, 0]


def by_wheels(poses: np.ndarray, steps: range) -> ConstraintList:
    return ConstraintList(
        Constraint(k, k + 1, between(poses[k], poses[k + 1]), np.eye(3), "odometry") for k in steps
    )


def test_wheels_that_the_map_follows_agree() -> None:
    agreement = wheel_agreement(by_wheels(STRAIGHT, range(20)), STRAIGHT, PATH)
    assert agreement.keyframes.tolist() == [[0, 4], [4, 8], [8, 12], [12, 16], [16, 20]]
    assert agreement.metres.max() < 1e-9


def test_a_step_that_the_map_has_otherwise_shows_in_its_window_only() -> None:
    mapped = STRAIGHT.copy()
    mapped[10:, 1] += 0.3
    agreement = wheel_agreement(by_wheels(STRAIGHT, range(20)), mapped, PATH)
    assert agreement.metres == pytest.approx([0.0, 0.0, 0.3, 0.0, 0.0])


def test_no_window_leads_over_a_step_that_wheels_did_not_measure() -> None:
    steps = ConstraintList([*by_wheels(STRAIGHT, range(9)), *by_wheels(STRAIGHT, range(10, 20))])
    windows = wheel_agreement(steps, STRAIGHT, PATH).keyframes.tolist()
    assert windows == [[0, 4], [4, 8], [10, 14], [14, 18]]


def test_wheels_that_drive_while_the_map_stands_still_are_compared_too() -> None:
    standing = np.zeros_like(STRAIGHT)
    agreement = wheel_agreement(by_wheels(STRAIGHT, range(20)), standing, np.zeros(21))
    assert agreement.metres == pytest.approx([2.0] * 5)


def test_the_map_denies_what_wheels_drive_in_vain_until_a_loop_decides() -> None:
    standing = np.zeros_like(STRAIGHT)
    agreement = wheel_agreement(by_wheels(STRAIGHT, range(20)), standing, np.zeros(21))
    are_closed = np.ones(20, dtype=np.bool_)
    assert agreement.denied == pytest.approx([2.0] * 5)
    assert agreement.unsettled(~are_closed) == pytest.approx(2.0)
    assert agreement.unsettled(are_closed) == 0.0


def test_nothing_is_denied_to_wheels_that_stand_while_the_car_is_lifted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lifted = STRAIGHT.copy()
    lifted[10:] += np.array([0.9, -0.2, 0.4])
    lifted[11:] = lifted[10]
    wheels = by_wheels(np.concatenate([STRAIGHT[:10], np.repeat(STRAIGHT[9:10], 11, axis=0)]), range(20))
    path = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(lifted[:, :2], axis=0).T))])
    monkeypatch.setattr("racecar.mapping.quality.wheel_agreement._WINDOW", 1.0)
    agreement = wheel_agreement(wheels, lifted, path)
    assert agreement.metres.max() > 0.9
    assert agreement.denied.max() < 1e-9


def test_no_wheels_deny_nothing() -> None:
    agreement = wheel_agreement(ConstraintList(), STRAIGHT, PATH)
    assert agreement.unsettled(np.zeros(20, dtype=np.bool_)) == 0.0
