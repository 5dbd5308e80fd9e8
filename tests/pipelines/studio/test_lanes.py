"""The curves behind the time bar."""

import re

import numpy as np
import pytest

from racecar.pipelines.runs.view.measures import Measure
from racecar.pipelines.studio.look.lanes import lanes

SECONDS = np.linspace(0.0, 1000.0, 100_001)


def heights(html: str) -> list[float]:
    """Of the points of the first curve, as the picture has them: 100 is the bottom."""
    points = re.search(r'points="([^"]*)"', html)
    assert points is not None
    return [float(point.split(",")[1]) for point in points[1].split()]


@pytest.mark.parametrize(("name", "usual", "spike"), [("doubt", 1.0, 100.0), ("fit", 95.0, 5.0)])
def test_no_spike_of_a_long_drive_is_lost(name: str, usual: float, spike: float) -> None:
    values = np.full(len(SECONDS), usual)
    values[54_321] = spike
    drawn = heights(lanes([Measure(name, "cm", SECONDS, values, name == "fit")], 1000.0, []))
    assert len(drawn) <= 1000
    assert (min if name == "doubt" else max)(drawn) == pytest.approx(100.0 - 0.96 * spike, abs=0.1)
    assert sorted(drawn)[len(drawn) // 2] == pytest.approx(100.0 - 0.96 * usual, abs=0.4)


def test_a_lane_says_what_it_holds_and_another_run_is_dashed_on_the_same_scale() -> None:
    speed = Measure("speed", "m/s", np.array([0.0, 5.0]), np.array([1.0, 1.9]))
    faster = Measure("speed", "m/s", np.array([0.0, 5.0]), np.array([1.0, 2.7]))
    assert "speed 0–2 m/s" in lanes([speed], 5.0, [])
    both = lanes([speed], 5.0, [], [faster])
    assert "speed 0–3 m/s" in both
    assert both.count("<polyline") == 2
    assert both.count("stroke-dasharray") == 1


def test_doubtful_seconds_are_bands() -> None:
    html = lanes([Measure("speed", "m/s", SECONDS, np.ones(len(SECONDS)))], 1000.0, [(100.0, 200.0)])
    assert 'x="100.0" width="100.0"' in html
