"""Work that comes due once in its period."""

import pytest

from racecar.pipelines.live.work import schedule as module
from racecar.pipelines.live.work.schedule import Schedule


def test_each_kind_of_work_is_due_once_in_its_period(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr(module.time, "monotonic", lambda: now)
    schedule = Schedule()
    assert schedule.is_due("map", 2.0)
    assert schedule.is_due("path", 0.5)
    assert not schedule.is_due("map", 2.0)
    now = 100.6
    assert schedule.is_due("path", 0.5)
    assert not schedule.is_due("map", 2.0)
    now = 101.0
    assert not schedule.is_due("path", 0.5)
    now = 102.0
    assert schedule.is_due("map", 2.0)
