from threading import Thread

from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.live.work.inbox import Inbox
from racecar.pipelines.live.work.worker import Worker


def test_work_comes_out_in_the_order_it_went_in() -> None:
    inbox, done = Inbox({"scan": 10, "pose": 10}), []
    for number in range(8):
        inbox.put("pose" if number % 3 else "scan", lambda number=number: done.append(number))
    inbox.close()
    while (work := inbox.get()) is not None:
        work()
    assert done == list(range(8))


def test_of_too_much_the_oldest_goes_and_other_kinds_stay() -> None:
    inbox, done = Inbox({"scan": 2, "pose": 2}), []
    inbox.put("pose", lambda: done.append("pose"))
    for number in range(5):
        inbox.put("scan", lambda number=number: done.append(number))
    inbox.close()
    while (work := inbox.get()) is not None:
        work()
    assert done == ["pose", 3, 4]
    assert inbox.dropped == {"scan": 3}


def test_who_waits_is_woken() -> None:
    inbox, done = Inbox({"scan": 1}), []
    thread = Thread(target=lambda: done.append(inbox.get()))
    thread.start()
    inbox.close()
    thread.join(5.0)
    assert done == [None]


def test_a_worker_outlives_what_its_work_raises() -> None:
    told: list[str] = []
    errors: list[Exception] = []
    done: list[int] = []
    worker = Worker("test", {"any": 10}, Faults(told.append, told.append), errors.append)

    def fail() -> None:
        raise ValueError("broken")

    worker.inbox.put("any", fail)
    worker.inbox.put("any", lambda: done.append(1))
    worker.start()
    worker.finish(5.0)
    assert done == [1]
    assert [str(error) for error in errors] == ["broken"]


def test_what_waits_is_left_out_where_nobody_wants_it_any_more() -> None:
    inbox, done = Inbox({"scan": 5, "pose": 5}), []
    for number in range(3):
        inbox.put("scan", lambda number=number: done.append(number))
    inbox.put("pose", lambda: done.append("pose"))
    assert inbox.clear("scan") == 3
    inbox.close()
    while (work := inbox.get()) is not None:
        work()
    assert done == ["pose"]
    assert inbox.dropped == {"scan": 3}
