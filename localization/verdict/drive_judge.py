"""Judge a drive: whether its estimates can be trusted."""

import math

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict.drive_quality import DriveQuality, DriveVerdict
from racecar.localization.verdict.map_fit import STEP, MapFit
from racecar.localization.verdict.pose_steps import PoseSteps
from racecar.localization.verdict.unknown_segments import UnknownSegments

_LOCALIZED_SHARE = 0.9
"""Share of the drive with a known place, so that a second or two of initial search, or one kidnapping, is
tolerated. Chosen by judgement."""
_LOST_SHARE = 0.5
"""Share below which a drive is lost unless the map is certainly right, because the place is then mostly
unknown. Chosen by judgement."""
_LONGEST_SCAN = 1.0
"""Largest time in seconds that one scan stands for, so that pauses of the recording do not count. Chosen by
judgement: some sensors send one scan a second."""
_PATIENCE, _PATIENCE_SHARE = 10.0, 0.1
"""Seconds of scans, and share of the time with a known place, for which a car may be lost on an apparently
wrong map before the search stops. Chosen by judgement, since a car that was carried elsewhere is found within
a second or two (`python -m benchmarks accuracy`), and some ten searches of the map fit into it."""


class DriveJudge:
    """Collects the estimates of all scans; the verdict is available at any time."""

    def __init__(self) -> None:
        self._fit = MapFit()
        self._steps = PoseSteps(STEP)
        self._segments = UnknownSegments()
        self._first: int | None = None
        self._last = 0
        self._seconds = self._known_seconds = self._lost_seconds = 0.0
        """Seconds of scans, without pauses."""
        self._deviations = 0.0
        """Standard deviation in metres, integrated over the seconds with a known place."""
        self.path_metres = 0.0
        """Path driven at known places, without jumps."""

    def follow(self, estimate: PoseEstimate) -> None:
        """Add the estimate of a scan; repeated ones are ignored."""
        if self._first is None:
            self._first, seconds = estimate.stamp, 0.0
        else:
            seconds = min((estimate.stamp - self._last) * 1e-9, _LONGEST_SCAN)
            if seconds <= 0.0 and self._last - estimate.stamp < _LONGEST_SCAN * 1e9:
                return
        self._last, seconds = estimate.stamp, max(seconds, 0.0)
        self._fit.follow(estimate)
        self.path_metres += self._steps.follow(estimate)[0]
        end = (estimate.stamp - self._first) * 1e-9
        self._segments.follow(estimate, end - seconds, end)
        self._seconds += seconds
        if estimate.is_place_known:
            self._known_seconds += seconds
            self._deviations += seconds * estimate.deviation
        elif estimate.is_lost:
            self._lost_seconds += seconds

    @property
    def quality(self) -> DriveQuality:
        """The verdict on the drive so far."""
        known = self._known_seconds
        share = known / self._seconds if self._seconds > 0.0 else 0.0
        verdict, reason = self._verdict(share)
        return DriveQuality(
            verdict=verdict,
            known_share=share,
            deviation=self._deviations / known if known > 0.0 else math.nan,
            map_log_odds=self._fit.log_odds,
            reasons=() if reason is None else (reason,),
            segments=self._segments.longest,
        )

    @property
    def is_hopeless(self) -> bool:
        """Whether further search is useless: the map is wrong, and the car was lost on it for long."""
        patience = _PATIENCE + _PATIENCE_SHARE * self._known_seconds
        return self._lost_seconds > patience and self._fit.is_wrong

    def _verdict(self, known_share: float) -> tuple[DriveVerdict, str | None]:
        """The verdict and its reason for people."""
        if self._fit.is_wrong:
            return (
                DriveVerdict.LOST,
                "Each scan fits better elsewhere on the map than where the car would be: it is the map of "
                "another place, or much has changed.",
            )
        if not self._fit.is_right:
            if known_share < _LOST_SHARE:
                return (
                    DriveVerdict.LOST,
                    "On most of the drive no place on the map fitted the scans, or several did.",
                )
            return (
                DriveVerdict.UNCERTAIN,
                "The drive does not show whether it is the right map or one that looks alike; drive farther.",
            )
        # On the right map, a place that stays in doubt is one of several similar ones.
        is_known = known_share >= _LOCALIZED_SHARE
        return DriveVerdict.LOCALIZED if is_known else DriveVerdict.UNCERTAIN, None
