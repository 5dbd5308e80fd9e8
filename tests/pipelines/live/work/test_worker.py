import pytest

from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.live.work.worker import Worker

ERRORS: list[Exception] = []


@pytest.fixture
def worker() -> Worker:
    ERRORS.clear()
    told: list[str] = []
    return Worker("test", Faults(told.append, told.append), ERRORS.append)


def finish(worker: Worker) -> None:
    worker.start()
    assert worker.finish(5.0)


def test_work_is_done_in_the_order_it_came(worker: Worker) -> None:
    done: list[int] = []
    for number in range(8):
        worker.put("pose" if number % 3 else "scan", lambda number=number: done.append(number), 10)
    finish(worker)
    assert done == list(range(8))


def test_of_too_much_the_oldest_goes_and_other_kinds_stay(worker: Worker) -> None:
    done: list[object] = []
    worker.put("pose", lambda: done.append("pose"))
    for number in range(5):
        worker.put("scan", lambda number=number: done.append(number), 2)
    assert worker.backlog("scan") == 2
    finish(worker)
    assert done == ["pose", 3, 4]
    assert worker.dropped == {"scan": 3}


def test_who_waits_is_woken(worker: Worker) -> None:
    worker.start()
    assert worker.finish(5.0)


def test_a_worker_outlives_what_its_work_raises(worker: Worker) -> None:
    done: list[int] = []

    def fail() -> None:
        raise ValueError("broken")

    worker.put("any", fail, 10)
    worker.put("any", lambda: done.append(1), 10)
    finish(worker)
    assert done == [1]
    assert [str(error) for error in ERRORS] == ["broken"]


def test_what_waits_is_left_out_where_nobody_wants_it_any_more(worker: Worker) -> None:
    done: list[object] = []
    for number in range(3):
        worker.put("scan", lambda number=number: done.append(number), 5)
    worker.put("pose", lambda: done.append("pose"))
    assert worker.clear("scan") == 3
    finish(worker)
    assert done == ["pose"]
    assert worker.dropped == {"scan": 3}
