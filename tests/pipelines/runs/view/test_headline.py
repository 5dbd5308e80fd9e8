"""Whether a car's place is known, in a line over the map."""

import math

import pytest

from racecar.pipelines.files.tone import Tone
from racecar.pipelines.runs.view.headline import place_headline
from tests.localization.verdict.estimates import estimate


@pytest.mark.parametrize(
    ("of_estimate", "words", "tone"),
    [
        ({"deviation": 0.04}, "Known ± 4 cm, ± ", Tone.GOOD),
        ({"deviation": 2.5}, "Uncertain ± 2.5 m, ± ", Tone.DOUBTFUL),
        ({"weight": 0.4}, "Uncertain", Tone.DOUBTFUL),
        ({"lost": 0.99}, "Lost", Tone.BAD),
    ],
)
def test_it_says_how_well_the_place_is_known_and_how_old_that_is(
    of_estimate: dict[str, float], words: str, tone: Tone
) -> None:
    headline = place_headline(estimate(11.0, 3.0, **of_estimate), 0.2)
    assert headline.words.startswith(words)
    assert headline.tone == tone
    assert headline.below.endswith("last scan 0.2 s ago")


@pytest.mark.parametrize("of_estimate", [{"deviation": 0.04}, {"lost": 0.99}])
def test_nothing_is_known_once_no_scan_arrives(of_estimate: dict[str, float]) -> None:
    headline = place_headline(estimate(11.0, 3.0, **of_estimate), 3.2)
    assert headline[:2] == ("Blind for 3 s", Tone.BAD)


def test_before_the_first_scan_there_is_no_pose() -> None:
    assert place_headline(None, math.inf)[:3] == ("No pose yet", Tone.NEUTRAL, "no scan yet")
