"""What one pass over a recording encounters, and the resulting findings."""

from collections import Counter
from collections.abc import Sequence

from racecar.pipelines.bags.facts import OdometryFacts, ScanFacts, YawRateFacts, findings_of_rare_scans
from racecar.pipelines.bags.odometry_spikes import OdometrySpikes
from racecar.pipelines.bags.repeated_scans import RepeatedScans
from racecar.pipelines.bags.scan_gaps import ScanGaps
from racecar.sensors.clocks.clock_rate import ClockRate, drift_finding
from racecar.sensors.clocks.topic_clock import SAME_JUMP, SteadyClock
from racecar.sensors.findings import Finding, counted_findings
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

_CLOCK_FAULTS = ("clock_jumps", "stamps_that_stood_still", "stamps_from_recording_time")
"""Counts of messages without a time in their header, or after the clock was set."""


class Heard:
    """Statistics of the accepted measurements, and counts of everything corrected or dropped."""

    def __init__(self) -> None:
        self.messages = 0
        self.clock = SteadyClock()
        """Shared by all topics; set with what is known about it in advance."""
        self.counts: Counter[str] = Counter()
        self.scans, self.odometry, self.yaw_rates = ScanFacts(), OdometryFacts(), YawRateFacts()
        self._gaps, self._repeats, self._spikes = ScanGaps(), RepeatedScans(), OdometrySpikes()
        self._clock_rates: dict[str, ClockRate] = {}

    def note_stamp(self, topic: str, header: int, recorded: int) -> None:
        """Note the header stamp and recording time of a message on a topic, in nanoseconds."""
        self._clock_rates.setdefault(topic, ClockRate()).add(header, recorded)

    def is_spike(self, item: Measurement) -> bool:
        """Whether the next item in time order is odometry to be dropped."""
        is_spike = isinstance(item, Odometry) and self._spikes.is_spike(item)
        self.counts["odometry_spikes"] = self._spikes.count
        return is_spike

    def takes(self, item: Measurement) -> bool:
        """Add the next item in time order; returns whether to pass it on."""
        if isinstance(item, Scan):
            self._gaps.add(item, self.odometry.path_length)
            if self._repeats.is_repeat(item):
                self.counts["repeated_scans"] += 1
                return False
            self.scans.add(item)
            self.counts["scans"] += 1
        elif isinstance(item, Odometry):
            self._repeats.add_odometry(item)
            self.odometry.add(item)
            self.counts["odometry"] += 1
        else:
            self.yaw_rates.add(item)
            self.yaw_rates.turns_elsewhere = self.counts["turns_about_other_axes"]
            self.counts["yaw_rates"] += 1
        return True

    def findings(
        self, scan_topic: str, motion_topics: Sequence[str | None], set_backs: Sequence[float] = ()
    ) -> list[Finding]:
        """Findings for the user; the clocks of the topics are compared. ``set_backs`` are the seconds by
        which the recorder's clock was set back; other findings report these."""
        return [
            *self._gaps.findings,
            *self._repeats.findings,
            *self._spikes.findings,
            *counted_findings(self.counts),
            *self._clock_jumps(set_backs),
            *self._clock_drifts(scan_topic, motion_topics),
            *self.scans.findings,
            *self.odometry.findings,
            *findings_of_rare_scans(self.scans, self.odometry),
            *self.yaw_rates.findings,
        ]

    def told_counts(self, unreadable: int) -> dict[str, int]:
        """Counts for reports, with ``unreadable`` messages; zeros only for scans and odometry."""
        counts = {"scans": 0, "odometry": 0, **self.counts}
        counts |= {"gaps": self._gaps.count, "unreadable_messages": unreadable}
        return {name: count for name, count in counts.items() if count or name in ("scans", "odometry")}

    def _clock_jumps(self, set_backs: Sequence[float]) -> list[Finding]:
        jumps = [
            f"{jump:+.1f}"
            for jump in self.clock.jumps
            if all(abs(jump + each) > SAME_JUMP * 1e-9 for each in set_backs)
        ]
        return [Finding("clock_jumps", seconds=", ".join(jumps))] if jumps else []

    def _clock_drifts(self, scan_topic: str, motion_topics: Sequence[str | None]) -> list[Finding]:
        """The first drift of a topic against the scans, unless a clock was set or showed no time."""
        if any(self.counts[name] for name in _CLOCK_FAULTS):
            return []
        own = self._clock_rates.get(scan_topic, ClockRate())
        drifts = (
            drift_finding(topic, self._clock_rates[topic], scan_topic, own)
            for topic in motion_topics
            if topic is not None and topic in self._clock_rates
        )
        return next((drift for drift in drifts if drift), [])
