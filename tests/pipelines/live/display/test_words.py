"""How a node is, in words for the page."""

import math

import numpy as np

from racecar.localization.verdict.drive_judge import DriveJudge
from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.quality.map_quality import MapQuality, Verdict
from racecar.mapping.state.growth import Growth
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.files.tone import Tone
from racecar.pipelines.live.display.words import localizer_words, mapper_headline, mapper_words
from tests.localization.verdict.estimates import straight_drive
from tests.pipelines.simulation.test_driven_simulation import a_drive, drive_on

GOOD = MapQuality(Verdict.GOOD, 0.03, 0.1, (), (), {})
WRONG = MapQuality(Verdict.WRONG, 0.4, 2.0, ("Passes disagree.",), (), {}, ("Passes disagree.",))


def test_the_localizer_says_what_the_drive_is_worth_and_what_is_wrong() -> None:
    judge = DriveJudge()
    assert localizer_words(None, ["No scans arrive."]) == "No scans arrive."
    assert localizer_words(judge.quality, []).startswith("The drive so far is lost. ")
    for each in straight_drive(10.0):
        judge.follow(each)
    drive, fault = localizer_words(judge.quality, ["Nothing arrives on /odom any more."]).split("\n\n")
    assert drive == "The drive so far is localized."
    assert fault == "Nothing arrives on /odom any more."


def test_the_mapper_heads_the_page_with_its_verdict_unless_no_scan_arrives() -> None:
    assert mapper_headline(None, math.inf).words == "Mapping"
    assert mapper_headline(GOOD, 0.1)[:3] == ("The map so far is good", Tone.GOOD, "last scan 0.1 s ago")
    assert mapper_headline(WRONG, 0.1).reasons == WRONG.reasons
    assert mapper_headline(GOOD, 3.2)[:2] == ("Blind for 3 s", Tone.BAD)


def test_the_mapper_says_how_much_is_mapped_and_what_it_is_worth() -> None:
    assert mapper_words(None, None, ["No scans."]) == "There is no map yet.\n\nNo scans."
    assert mapper_words(Growth(keyframes=1), None, []).split("\n\n") == [
        "**0 m** driven, 1 keyframe, 0 loop closures.",
        "The map is judged once a minute.",
    ]
    grown = mapper_words(Growth(keyframes=120, loops=1, metres=40.2), GOOD, ["It is behind."]).split("\n\n")
    assert grown[0] == "**40 m** driven, 120 keyframes, 1 loop closure."
    assert grown[1] == f"So far: {GOOD.summary}"
    assert grown[2] == "It is behind."
    assert "passes disagree" in mapper_words(Growth(keyframes=120, loops=1, metres=40.2), WRONG, [])


def test_as_much_is_mapped_as_was_driven() -> None:
    simulation, mapper = a_drive(), Mapper(MappingConfig())
    simulation.drive_to(np.array([2.5, 4.5]))
    before = simulation.truth
    for measurement in drive_on(simulation):
        feed(measurement, mapper)
    growth = mapper.growth
    assert growth.metres >= np.hypot(*(simulation.truth - before)[:2]) - 0.3
    assert growth.keyframes == len(mapper.session().rays) > 3
    assert growth.loops == 0
    assert Mapper(MappingConfig()).growth == Growth()
