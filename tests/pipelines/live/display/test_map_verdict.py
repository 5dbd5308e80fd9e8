"""The map that grows is judged from time to time, by another thread."""

from collections.abc import Callable
from typing import Any

import pytest

from racecar.mapping.quality.map_quality import MapQuality, Verdict

GOOD = MapQuality(Verdict.GOOD, 0.03, 0.1, (), (), {})
WRONG = MapQuality(Verdict.WRONG, 0.4, 2.0, ("Passes disagree.", "And more."), (), {})


class LaterWorker:
    """Does what it was given when it is told to."""

    def __init__(self) -> None:
        self.work: list[Callable[[], None]] = []

    def put(self, kind: str, work: Callable[[], None]) -> None:
        assert kind == "verdict"
        self.work.append(work)

    def do_all(self) -> None:
        while self.work:
            self.work.pop(0)()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The seconds on the clock, which a test may change."""
    seconds = [1000.0]
    monkeypatch.setattr("racecar.pipelines.live.display.map_verdict.time.monotonic", lambda: seconds[0])
    return seconds


def test_judges_each_minute_and_says_the_first_reason(clock: list[float]) -> None:
    from racecar.pipelines.live.display.map_verdict import MapVerdict

    worker: Any = LaterWorker()
    verdict = MapVerdict(worker)
    verdict.judge_when_due(lambda: lambda: GOOD)
    assert not worker.work
    clock[0] += 61.0
    verdict.judge_when_due(lambda: lambda: GOOD)
    verdict.judge_when_due(lambda: lambda: GOOD)
    assert len(worker.work) == 1
    assert verdict.figures == {}
    worker.do_all()
    assert verdict.figures["map so far"] == "good"
    assert verdict.figures["doubt"] == "none"
    clock[0] += 61.0
    verdict.judge_when_due(lambda: lambda: WRONG)
    worker.do_all()
    assert verdict.figures["map so far"] == "wrong"
    assert verdict.figures["doubt"] == "Passes disagree."
    assert verdict.figures["expected error (m per 10 m)"] == 0.4


def test_rests_a_hundred_times_as_long_as_judging_takes_and_survives_a_fault(clock: list[float]) -> None:
    from racecar.pipelines.live.display.map_verdict import MapVerdict

    def slow() -> MapQuality:
        clock[0] += 2.0
        raise ValueError

    worker: Any = LaterWorker()
    verdict = MapVerdict(worker)
    clock[0] += 61.0
    verdict.judge_when_due(lambda: slow)
    with pytest.raises(ValueError):
        worker.do_all()
    for seconds, expected in ((190.0, 0), (11.0, 1)):
        clock[0] += seconds
        verdict.judge_when_due(lambda: lambda: GOOD)
        assert len(worker.work) == expected
