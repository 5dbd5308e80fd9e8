"""The judge of a drive: whether the poses of its estimates are to be believed."""

import math

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict.config import VerdictConfig
from racecar.localization.verdict.drive_quality import DriveQuality, DriveVerdict
from racecar.localization.verdict.known_place import deviation, is_lost, is_place_known
from racecar.localization.verdict.map_fit import MapFit
from racecar.localization.verdict.pose_steps import PoseSteps
from racecar.localization.verdict.unknown_segments import UnknownSegments


class DriveJudge:
    """Takes in the estimate of every scan, and says at any time what the drive so far is worth."""

    def __init__(self, config: VerdictConfig) -> None:
        self._config = config
        self._fit = MapFit(config.map_fit)
        self._steps = PoseSteps(config.map_fit.step)
        self._segments = UnknownSegments(config)
        self._first: int | None = None
        self._last = 0
        self._seconds = self._known_seconds = self._lost_seconds = 0.0
        """Of scans; without pauses."""
        self._deviations = 0.0
        """Metres of standard deviation, summed over the seconds in which the place is known."""
        self.path_metres = 0.0
        """Driven, as far as it is known: without jumps to another place."""

    def follow(self, estimate: PoseEstimate) -> None:
        """Take in the estimate of a scan; those that repeat one are left out."""
        longest = self._config.longest_scan
        if self._first is None:
            self._first, seconds = estimate.stamp, 0.0
        else:
            seconds = min((estimate.stamp - self._last) * 1e-9, longest)
            if seconds <= 0.0 and self._last - estimate.stamp < longest * 1e9:
                return
        self._last, seconds = estimate.stamp, max(seconds, 0.0)
        self._fit.follow(estimate)
        self.path_metres += (self._steps.follow(estimate) or (0.0, 0.0))[0]
        end = (estimate.stamp - self._first) * 1e-9
        self._segments.follow(estimate, end - seconds, end)
        self._seconds += seconds
        if is_place_known(estimate, self._config.known_place):
            self._known_seconds += seconds
            self._deviations += seconds * deviation(estimate)
        elif is_lost(estimate, self._config.known_place):
            self._lost_seconds += seconds

    @property
    def quality(self) -> DriveQuality:
        """Of the drive so far."""
        share = self._known_seconds / self._seconds if self._seconds > 0.0 else 0.0
        verdict = self._verdict(share)
        known = self._known_seconds
        return DriveQuality(
            verdict=verdict,
            known_share=share,
            deviation=self._deviations / known if known > 0.0 else math.nan,
            map_log_odds=self._fit.log_odds,
            reasons=self._reasons(verdict),
            segments=self._segments.longest,
        )

    @property
    def is_hopeless(self) -> bool:
        """Whether searching on is in vain: the map is a wrong one, and the car was lost on it for long."""
        patience = self._config.patience + self._config.patience_share * self._known_seconds
        return self._lost_seconds > patience and self._fit.is_wrong

    def _verdict(self, known_share: float) -> DriveVerdict:
        if self._fit.is_wrong:
            return DriveVerdict.LOST
        if not self._fit.is_right:
            return DriveVerdict.LOST if known_share < self._config.lost_share else DriveVerdict.UNCERTAIN
        # Scans that fit closely at a place that is in doubt are those of a map whose places look alike.
        is_known = known_share >= self._config.localized_share
        return DriveVerdict.LOCALIZED if is_known else DriveVerdict.UNCERTAIN

    def _reasons(self, verdict: DriveVerdict) -> tuple[str, ...]:
        if self._fit.is_wrong:
            return (
                "Nowhere do the scans fit the map as closely as where it was made: it is the map of another "
                "place, or much has changed.",
            )
        if verdict == DriveVerdict.LOST:
            return ("On most of the drive no place on the map fitted the scans, or several did.",)
        if not self._fit.is_right:
            return (
                "The drive does not show whether it is the right map or one that looks alike; drive farther.",
            )
        return ()
