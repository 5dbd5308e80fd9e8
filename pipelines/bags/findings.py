"""What can be wrong with a bag, and what to do about it."""

from collections import Counter
from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """Something wrong with a bag."""

    what: str
    remedy: str
    spoils_map: bool = False
    """A map made of the bag as it is would be wrong, or not be made at all."""

    @property
    def sentence(self) -> str:
        """What is wrong and what to do about it."""
        return f"{self.what} {self.remedy}"


ONE_CLOCK = "Stamp all messages by one clock (chrony, or drivers on one computer)."
"""The remedy for clocks that differ."""

BY_SCANS_ALONE = (
    "the motion is estimated from the scans alone, which fails along bare corridors and in fast turns"
)
"""What comes of odometry that is missing, or not used."""


def times(count: int) -> str:
    """Such as "once", "twice" and "3 times"."""
    return {1: "once", 2: "twice"}.get(count, f"{count} times")


_COUNTED = {
    "dropped_out_of_order": (
        "Messages dropped because their stamps are over a second out of order",
        "Stamp all messages by one clock (chrony, or use_sim_time everywhere).",
    ),
    "dropped_duplicates": (
        "Messages dropped because another of their topic has the same stamp",
        "Make sure that only one driver publishes the topic; if so, nothing is lost.",
    ),
    "stamps_from_recording_time": (
        "Stamps that were zero or absurd, replaced by the time of recording",
        "Make the driver stamp its messages; until then expect some jitter.",
    ),
    "stamps_that_stood_still": (
        "Stamps that stood still while messages came, replaced by the time of recording",
        "Restart the driver, or make it stamp each message when it is measured.",
    ),
    "clock_jumps": (
        "Jumps of the stamps of a topic, because a clock was set; they are taken to go on as before",
        "Set the clock before the drive (chrony), and do not restart drivers while recording.",
    ),
    "empty_scans": (
        "Scans dropped because they hold no usable beams",
        "Look at the driver's log for the times when the sensor failed.",
    ),
    "scans_beyond_one_turn": (
        "Scans dropped because their beams go round more than once",
        "Make the driver send each turn as a scan of its own, with the angle_increment of that turn.",
    ),
    "undecodable_messages": (
        "Messages dropped because their bytes are damaged",
        "Copy the bag again from where it was recorded.",
    ),
    "oversized_messages": (
        "Messages dropped because they are larger than any sensor's",
        "Copy the bag again from where it was recorded, and look at what the driver publishes.",
    ),
    "invalid_odometry": (
        "Odometry messages dropped because they hold no valid pose",
        "Make the odometry node set the pose's quaternion (w = 1 for no rotation).",
    ),
    "messages_without_pose": (
        "Messages dropped because they hold no valid pose",
        "Make the node that publishes them set the pose's quaternion (w = 1 for no rotation).",
    ),
    "time_increments_ignored": (
        "Scans with a time_increment too long to be true, which is taken as zero",
        "Correct it in the driver, so that scans can be corrected for the motion during a sweep.",
    ),
    "point_times_ignored": (
        "Clouds that time their points over a second away from their stamp, which is ignored",
        "Make the driver stamp clouds and points by the same clock, so that the motion can be corrected for.",
    ),
    "changed_beam_counts": ("Changes of the number of beams", "No action is needed."),
    "scans_without_range_max": (
        "Scans that do not state the sensor's range, for which 60 m is assumed",
        "Set range_max in the driver, so that misses are not taken for walls.",
    ),
}

_LOST = (
    "dropped_out_of_order",
    "empty_scans",
    "scans_beyond_one_turn",
    "undecodable_messages",
    "oversized_messages",
)
"""Counts of messages that are missing in the map."""
_MUCH_LOST = 0.25
"""Of all messages; a drive of which more is lost has holes that no odometry bridges: by judgement."""


def counted_findings(counts: Counter[str]) -> list[Finding]:
    """What was mended or dropped while reading."""
    lost = sum(counts[name] for name in _LOST)
    is_much = lost > _MUCH_LOST * (lost + counts["scans"] + counts["odometry"])
    findings = [
        Finding(f"{what}: {counts[name]}.", remedy, is_much and name in _LOST)
        for name, (what, remedy) in _COUNTED.items()
        if counts[name]
    ]
    lacking = counts["scans_without_odometry"]
    if lacking > 0.01 * counts["scans"] + 2:
        findings.append(
            Finding(
                f"{lacking} of {counts['scans']} scans were taken while there was no odometry.",
                "Make sure that the odometry runs all the time and is stamped by the same clock as the "
                "scans.",
            )
        )
    return findings
