"""The axis of time without pauses."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from racecar.pipelines.files.pictures.driven_time import DrivenTime


def label(time: DrivenTime) -> str:
    axes = Figure().subplots(2, 1)
    time.mark(*axes)
    return str(axes[-1].get_xlabel())


def test_pauses_take_no_room_and_no_line_crosses_them() -> None:
    first, second = np.arange(0.0, 20.0, 0.1), np.arange(3620.0, 3640.0, 0.1)
    seconds = np.concatenate([first, second])
    time = DrivenTime(seconds)
    places, values = time.line(seconds, np.ones(len(seconds)))
    assert np.nanmax(places) == pytest.approx(39.8)
    assert np.flatnonzero(np.isnan(values)).tolist() == [len(first)]
    assert label(time) == "time (s), without a pause of 60 min"


def test_several_recordings_share_the_axis() -> None:
    a, b = np.arange(0.0, 20.0, 0.1), np.concatenate([np.arange(0.0, 5.0, 0.1), np.arange(40.0, 45.0, 0.1)])
    time = DrivenTime(a, b)
    assert time.of(np.array([10.0, 44.0])) == pytest.approx([10.0, 19.9 + 4.0])
    assert label(time) == "time (s), without a pause of 20 s"


@pytest.mark.parametrize(
    "seconds", [np.arange(0.0, 60.0, 4.0), np.arange(0.0, 5.0, 0.1), np.zeros(1), np.zeros(0)]
)
def test_without_pauses_nothing_changes(seconds: np.ndarray) -> None:
    time = DrivenTime(seconds)
    np.testing.assert_allclose(time.of(seconds), seconds)
    assert label(time) == "time (s)"
