"""A share of the machine's cores."""

import pytest

from racecar.sensors.threads import thread_count


@pytest.mark.parametrize(
    ("allowed", "threads"), [("1", 1), ("2", 2), ("16", 2), ("", 2), ("0", 2), ("4,2", 2)]
)
def test_no_more_than_the_environment_allows(
    allowed: str, threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", allowed)
    assert thread_count(2) == threads
