import pytest

from racecar.pipelines.live.monitoring import faults as module
from racecar.pipelines.live.monitoring.faults import Faults


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    clock = [100.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: clock[0])
    return clock


@pytest.fixture
def log() -> list[str]:
    return []


def test_what_lasts_is_told_once_until_it_is_right_again(now: list[float], log: list[str]) -> None:
    faults = Faults(log.append, log.append)
    for _ in range(5):
        faults.report("scans", "no scans")
        now[0] += 10.0
    assert log == ["no scans"]
    assert faults.sentences == ["no scans"]
    faults.end("scans", "scans again")
    faults.end("scans", "scans again")
    assert log == ["no scans", "scans again"]
    assert faults.sentences == []
    faults.report("scans", "no scans")
    assert log[2:] == ["no scans"]
    assert faults.counts == {"scans": 2}


def test_what_happened_once_passes(now: list[float], log: list[str]) -> None:
    faults = Faults(log.append, log.append)
    faults.report("pose", "refused", lasting=False)
    assert faults.sentences == ["refused"]
    now[0] += module.EVENT_SECONDS + 0.1
    assert faults.sentences == []
    faults.report("pose", "refused", lasting=False)
    assert log == ["refused", "refused"]


def test_another_sentence_is_told_too_but_not_a_flood_of_them(now: list[float], log: list[str]) -> None:
    faults = Faults(log.append, log.append)
    for number in range(1000):
        faults.report("pose", f"refused {number}", lasting=False)
        now[0] += 0.001
    assert log[0] == "refused 0"
    assert 2 <= len(log) <= 7


def fail(number: int) -> Exception:
    try:
        raise RuntimeError(f"scan {number}")
    except RuntimeError as error:
        return error


def test_what_fails_again_and_again_at_one_place_is_logged_once(now: list[float], log: list[str]) -> None:
    faults = Faults(log.append, log.append)
    for number in range(100):
        faults.report_failure(fail(number))
        now[0] += 10.0
    assert len(log) == 1
    assert "RuntimeError: scan 0" in log[0]
    assert list(faults.counts.values()) == [100]


def test_names_that_nobody_can_read_are_cut(log: list[str]) -> None:
    faults = Faults(log.append, log.append)
    faults.report("frame", f"No transform says where {'x' * 5000} sits.")
    assert len(log[0]) < 300
    assert log[0].endswith("… sits.")
    assert faults.sentences == log
