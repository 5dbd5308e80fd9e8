"""What each finding means for a map, in a word."""

from collections.abc import Mapping
from enum import Enum


class Grade(str, Enum):
    """What a finding means for a map that is made from the recording as it is, from harmless to worst."""

    FINE = "fine"
    """Nothing is lost by it."""
    CORRECTED = "corrected"
    """Put right while reading; what cannot be is left out, and too little to matter."""
    MAY_SPOIL_MAP = "may spoil the map"
    """Look at the map where it matters: something is missing, or was decided on doubtful grounds."""
    SPOILS_MAP = "spoils the map"
    """The map would be wrong, or cannot be made at all."""


_FINE = (
    "changed_beam_counts",
    "laser_of_several",
    "odometry_topic_of_several",
    "parts_not_named",
    "place_by_another_frame",
    "scan_topic_of_several",
)
_CORRECTED = (
    "angles_not_as_stated",
    "beams_reversed",
    "beams_vary",
    "bearings_scaled",
    "clock_jumps",
    "clocks_apart",
    "clocks_of_other_origins",
    "distances_disagree",
    "dropped_duplicates",
    "imu_lags",
    "misses_as_a_range",
    "odometry_by_speeds",
    "odometry_lags",
    "odometry_link_stands",
    "odometry_of_two_programs",
    "odometry_resets_by_speeds",
    "odometry_spikes",
    "odometry_topic_stands",
    "odometry_turns_from_imu",
    "odometry_without_orientation",
    "place_learned",
    "place_of_two",
    "place_turned",
    "ranges_in_another_unit",
    "recorder_set_back",
    "scans_repeated",
    "signs_changed",
    "stamps_from_recording_time",
    "stamps_that_stood_still",
)
GRADES: Mapping[str, Grade] = {
    **dict.fromkeys(_FINE, Grade.FINE),
    **dict.fromkeys(_CORRECTED, Grade.CORRECTED),
}
"""By the name of a finding, unless something about it spoils the map; those not listed may spoil it."""
