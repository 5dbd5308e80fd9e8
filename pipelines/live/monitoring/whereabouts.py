"""Whether the live car is localized, for the log; the verdict on its poses, for the diagnostics."""

from collections.abc import Callable
from typing import Any

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.hypotheses import CONFIRMED_BELOW
from racecar.localization.verdict.drive_judge import DriveJudge
from racecar.localization.verdict.drive_quality import DriveQuality

_SETTLING = 1_000_000_000
"""Nanoseconds for which a car not yet localized may not fit the map: its first scans decide where it is,
which took up to 0.25 s."""


class Whereabouts:
    """Judges the drive on one map."""

    def __init__(self, inform: Callable[[str], None]) -> None:
        """``inform`` receives a sentence whenever the car is localized, at first and after it was lost."""
        self._inform = inform
        self._judge = DriveJudge()
        self._is_found = self._was_found = False
        self._first: int | None = None
        self.may_be_lost = False
        """Whether the car fits nowhere, and a warning is due."""

    def follow(self, estimate: PoseEstimate) -> None:
        """Add the estimate of a scan."""
        self._judge.follow(estimate)
        self._first = estimate.stamp if self._first is None else self._first
        is_settled = self._was_found or estimate.stamp - self._first >= _SETTLING
        self.may_be_lost = is_settled and estimate.is_lost and not estimate.is_start
        if estimate.is_lost:
            self._is_found = False
            return
        is_certain = estimate.lost_probability < CONFIRMED_BELOW
        if is_certain and not self._is_found and estimate.is_place_known:
            self._is_found = self._was_found = True
            x, y, yaw = estimate.map_from_base.tolist()
            self._inform(f"Found: the car is at x {x:.2f} m, y {y:.2f} m, yaw {yaw:.2f} rad.")

    @property
    def quality(self) -> DriveQuality:
        """The verdict on the drive so far, as `racecar localize` gives it at the end."""
        return self._judge.quality

    @property
    def figures(self) -> dict[str, Any]:
        """The same for the diagnostics."""
        quality = self.quality
        return {
            "drive so far": quality.verdict.value,
            "share of it with a known place": quality.known_share,
            "log-odds that the map is the right one": quality.map_log_odds,
            "doubt": next(iter(quality.reasons), "none"),
        }
