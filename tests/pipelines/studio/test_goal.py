"""How the car comes to a goal, in words."""

import numpy as np
import pytest

from racecar.pipelines.studio.watch import goal as module
from racecar.pipelines.studio.watch.goal import Goal


class Clock:
    now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(module, "time", clock)
    return clock


def test_a_car_that_stands_short_of_its_goal_is_told(clock: Clock) -> None:
    goal = Goal(np.array([5.0, 0.0, 0.0]))
    assert goal.follow(np.zeros(3)) == "5.0 m to the goal."
    clock.now += 4.0
    assert goal.follow(np.array([-3.0, 0.0, 0.0])) == "8.0 m to the goal."  # it has to go round something
    clock.now += 4.0
    assert goal.follow(np.array([-3.0, 0.01, 0.0])) == "8.0 m to the goal."
    clock.now += 4.0
    assert "The car stands" in goal.follow(np.array([-3.0, 0.0, 0.0]))
    assert goal.follow(np.array([4.0, 0.0, 0.0])) == "1.0 m to the goal."


def test_a_car_that_has_arrived_has_arrived(clock: Clock) -> None:
    goal = Goal(np.array([5.0, 0.0, 0.0]))
    goal.follow(np.zeros(3))
    assert goal.follow(np.array([4.9, 0.1, 1.0])) == "The car is at the goal."
    clock.now += 60.0
    assert goal.follow(np.array([9.0, 0.0, 0.0])) == "The car is at the goal."
    assert len(goal.drawing(0.3)) == 0
