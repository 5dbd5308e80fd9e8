"""What is told of a map before its figures are believed."""

import pytest

from racecar.localization.verdict.drive_quality import DriveVerdict
from racecar.pipelines.runs.map_cautions import cautions_of_fit


@pytest.mark.parametrize(
    ("verdict", "told"),
    [(DriveVerdict.LOCALIZED, "much has changed"), (DriveVerdict.UNCERTAIN, "it is the wrong map")],
)
def test_why_scans_fit_poorly_agrees_with_the_verdict(verdict: DriveVerdict, told: str) -> None:
    (caution,) = cautions_of_fit(0.3, verdict)
    assert told in caution
    assert "Only 30% of the scans' end points" in caution
    assert cautions_of_fit(0.6, verdict) == []


def test_what_the_verdict_says_itself_is_not_said_twice() -> None:
    assert cautions_of_fit(0.3, DriveVerdict.LOST) == []
