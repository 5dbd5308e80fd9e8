"""Whoever listens hears how far work is."""

import pytest

from racecar.pipelines.runs.progress import progress_bar, progress_heard_by


@pytest.mark.parametrize(("total", "shares"), [(4.0, [0.0, 0.25, 1.0]), (0.0, [0.0, 1.0, 1.0])])
def test_a_listener_hears_the_share_that_is_done(total: float, shares: list[float]) -> None:
    heard: list[tuple[str, float]] = []
    with (
        progress_heard_by(lambda *news: heard.append(news)),
        progress_bar("Reading", total, quiet=True) as advance_to,
    ):
        advance_to(1.0)
        advance_to(5.0)
    assert heard == [("Reading", share) for share in shares]


def test_nobody_hears_of_what_comes_later() -> None:
    heard: list[str] = []
    with progress_heard_by(lambda what, share: heard.append(what)):
        pass
    with progress_bar("Reading", quiet=True) as advance_to:
        advance_to(1.0)
    assert heard == []
