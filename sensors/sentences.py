"""The sentences for each finding, by its name: what is wrong, and what to do about it."""

from collections.abc import Callable, Mapping
from typing import TypeAlias

Sentences: TypeAlias = tuple[str, str]
"""The problem and the remedy, with the finding's numbers in braces."""


def by_name(parameter: str) -> str:
    """How to give a parameter: by that name in Python and to ROS nodes, by its flag to commands."""
    return f"(parameter {parameter}, flag --{parameter.replace('_', '-')})"


ONE_CLOCK = "Stamp all messages by one clock (chrony, or drivers on one computer)."
"""The remedy for clocks that differ."""

_BY_SCANS_ALONE = (
    "the motion is estimated from the scans alone, which fails along bare corridors and in fast turns"
)
"""The consequence of odometry that is missing or not used."""
_COPY_AGAIN = "Copy the bag again from where it was recorded."
_SET_QUATERNION = "set the pose's quaternion (w = 1 for no rotation)."
_SET_ANGLES = "Correct angle_min, angle_max and angle_increment"
_RANGES_IN_METRES = "Make the driver report ranges in metres."
_REPEATED_BY = "Find out why the laser's driver, or whatever relays its scans, repeats itself."
_GOES_ON = "The drive goes on."
_NOT_USED = f"it is not used, and {_BY_SCANS_ALONE}."
_FAULTY_ODOMETRY = f"The odometry on {{topic}} {{fault}}: {_NOT_USED}"
_CARRIED = "Unless the robot was carried,"
_POSE = f"the laser's pose {by_name('laser_pose')}"
_ANOTHER_SCAN_TOPIC = f"Choose another {by_name('scan_topic')}"

_RESET_BEFORE = (
    "Find out what resets it, such as a timer that calls its driver, and reset it between drives only."
)
_SET_BEFORE = "Set the clock before the drive (chrony), and do not restart drivers while recording."

COUNTED: Mapping[str, Sentences] = {
    "dropped_out_of_order": (
        "Messages dropped because their stamps are over a second out of order: {count}.",
        "Stamp all messages by one clock (chrony, or use_sim_time everywhere).",
    ),
    "dropped_duplicates": (
        "Messages dropped because another of their topic has the same stamp: {count}.",
        "Make sure that only one driver publishes the topic; if so, nothing is lost.",
    ),
    "stamps_from_recording_time": (
        "Stamps that were zero or absurd, replaced by the time of recording: {count}.",
        "Make the driver stamp its messages; until then expect some jitter.",
    ),
    "stamps_that_stood_still": (
        "Stamps that stood still while messages came, replaced by the time of recording: {count}.",
        "Restart the driver, or make it stamp each message when it is measured.",
    ),
    "empty_scans": (
        "Scans dropped because they hold no usable beams: {count}.",
        "Look at angle_min, angle_max and angle_increment, and at the driver's log for the times when the "
        "sensor failed.",
    ),
    "scans_beyond_one_turn": (
        "Scans dropped because their beams go round more than once: {count}.",
        "Make the driver send each turn as a scan of its own, with the angle_increment of that turn.",
    ),
    "undecodable_messages": ("Messages dropped because their bytes are damaged: {count}.", _COPY_AGAIN),
    "oversized_messages": (
        "Messages dropped because they are larger than any sensor's: {count}.",
        f"{_COPY_AGAIN[:-1]}, and look at what the driver publishes.",
    ),
    "invalid_odometry": (
        "Odometry messages dropped because they hold no valid pose: {count}.",
        f"Make the odometry node publish only what it knows, and {_SET_QUATERNION}",
    ),
    "messages_without_pose": (
        "Messages dropped because they hold no valid pose: {count}.",
        f"Make the node that publishes them {_SET_QUATERNION}",
    ),
    "time_increments_ignored": (
        "Scans with a time_increment too long to be true, which is taken as zero: {count}.",
        "Correct it in the driver, so that scans can be corrected for the motion during a sweep.",
    ),
    "point_times_ignored": (
        "Clouds that time their points over a second away from their stamp, which is ignored: {count}.",
        "Make the driver stamp clouds and points by the same clock, so that the motion can be corrected for.",
    ),
    "changed_beam_counts": ("Changes of the number of beams: {count}.", ""),
    "scans_without_range_max": (
        "Scans that do not state the sensor's range, for which 60 m is assumed: {count}.",
        "Set range_max in the driver, or the setting sensors.max_range, so that misses are not taken for "
        "walls.",
    ),
}
"""Counted while reading, under these names: what was corrected or dropped."""

_BAG: Mapping[str, Sentences] = {
    "bag_damaged": ("{loss}", _COPY_AGAIN),
    "recorder_set_back": (
        "The clock was set back by {seconds:.1f} s while recording, after {at:.1f} s, as the order of the "
        f"messages in the file shows: they are read in that order. {_GOES_ON}",
        _SET_BEFORE,
    ),
    "parts_not_named": (
        "Parts of the recording that {metadata} does not name are read too: {names}.",
        "`ros2 bag reindex` repairs it for other programs.",
    ),
    "files_not_named": (
        "{metadata} does not name {names}: it is not read.",
        "Give the file itself if it is meant.",
    ),
    "topic_of_two_types": (
        "{topic} holds {read}, and {messages} messages of {left_out}, which are not read.",
        "Make sure that only one node publishes the topic.",
    ),
    "scan_topic_of_several": (
        "Scans are taken from {taken}, not from {others}.",
        f"{_ANOTHER_SCAN_TOPIC}, if this is not the one.",
    ),
    "laser_of_several": (
        "Scans are taken from {taken}, not from {others}.",
        f"{_ANOTHER_SCAN_TOPIC}, or give several if several lasers are to be used.",
    ),
    "odometry_topic_of_several": (
        "Odometry messages are taken from {taken}, not from {others}.",
        f"Choose another {by_name('odom_topic')}, if this is not the one.",
    ),
}


def _scan_gaps(*, gaps: str, more: int, was_driven: bool) -> Sentences:
    remedy = "find out what stopped the laser or the recorder."
    stood = "Unless the car stood still meanwhile, look whether the map breaks"
    return (
        f"There is {gaps}{f'; and {more} more' if more else ''}.",
        f"Look whether the map breaks there, and {remedy}" if was_driven else f"{stood} there, and {remedy}",
    )


def _scans_rare(
    *, seconds: float, metres: float | None, speed: float, shortest: float, are_some_lost: bool, are_all: bool
) -> Sentences:
    told = (
        "and no odometry follows the car in between: where it turns or drives far, its way is lost"
        if metres is None
        else f"in which the car usually drives {metres:.1f} m: they share little, so that most depends on "
        "the wheels"
    )
    what, slow_enough = f"The scans come every {seconds:.2g} s, {told}.", f"below {speed:.2g} m/s"
    if are_some_lost:
        return what, (
            f"Some come {shortest:.2g} s apart, so others got lost: find out why (a slow disk, a full queue, "
            f"a weak network), or drive {slow_enough}."
        )
    if are_all:
        return what, f"Drive {slow_enough}; the laser takes no more scans than these."
    return what, f"Drive {slow_enough}, or record all scans if the laser takes more than these."


def _angles_not_as_stated(
    *, beams: int, first: float, step: float, last: float, is_beyond_a_turn: bool, reading: str, evidence: str
) -> Sentences:
    stated = f"{beams} beams from {first:g} on, {step:g} apart,"
    what = (
        f"The angles of the scans are not radians: {stated} go round more than once"
        if is_beyond_a_turn
        else f"The angles of the scans contradict each other: {stated} do not end at {last:g}"
    )
    ending = f". They are read {reading}, {evidence}." if reading else ", and nothing else that makes sense."
    return f"{what}{ending}", f"{_SET_ANGLES} (radians) in the driver."


_SCANS: Mapping[str, Sentences | Callable[..., Sentences]] = {
    "scan_gaps": _scan_gaps,
    "scans_rare": _scans_rare,
    "scans_repeated": (
        "{count} scans repeat the one before to the last bit while the odometry moves, the first at "
        "{first:.1f} s and for up to {longest:.1f} s at a time: they are left out, as they show nothing new.",
        _REPEATED_BY,
    ),
    "scans_without_odometry": (
        "{count} of {scans} scans were taken while there was no odometry.",
        "Make sure that the odometry runs all the time and is stamped by the same clock as the scans.",
    ),
    "beams_too_few": (
        "The scans have only {beams} beams, {apart:.0f}° apart: no wall is recognized from one scan to the "
        "next, and the map is no better than the wheels.",
        "Make the driver publish all that the sensor measures, at least one beam per {enough:.0f}°.",
    ),
    "scans_blank": (
        "In {count} of {scans} scans no beam met anything, for up to {seconds:.1f} s at a time: only wheels "
        "can show the motion there.",
        "Make sure that nothing covers the laser and that it keeps running.",
    ),
    "beams_without_reading": (
        "{share:.0%} of the beams hold no reading (NaN, zero or below range_min).",
        "Clean the sensor's window, make sure that the car does not cover it, and look at range_min "
        "and the setting sensors.min_range.",
    ),
    "nothing_seen": (
        "Not one beam met anything.",
        "Make sure that nothing covers the laser, that it works, and that range_min and range_max, or "
        "the settings sensors.min_range and sensors.max_range, are right.",
    ),
    "angles_not_as_stated": _angles_not_as_stated,
    "beams_vary": (
        "The scans have {fewest} to {most} beams, always {step:g} apart by what they state, but end at "
        "{last:g}: they are read {reading}.",
        "Make the driver state the angle_increment of each scan.",
    ),
    "ranges_in_another_unit": (
        "Half of the ranges are above {median:g} m, which is impossible: they are read as {unit}.",
        _RANGES_IN_METRES,
    ),
    "ranges_absurd": ("Half of the ranges are above {median:g} m: they cannot be metres.", _RANGES_IN_METRES),
    "misses_as_a_range": (
        "{share:.0%} of the ranges are exactly {metres:g} m, at {bearings} bearings: they are taken for "
        "misses.",
        "Make the driver report inf, or set range_max to that, so that nobody takes misses for walls.",
    ),
    "beams_reversed": (
        "The beams of {topic} were measured in the opposite order of time to the one recorded, as the turns "
        "show: they are read so.",
        "Drivers of the RPLIDAR kind turn the ranges round and leave time_increment positive.",
    ),
    "bearings_scaled": (
        "The beams of {topic} lie over {factor:.2f} times the angle that is stated, as straight walls and "
        "the turns show: they are read so.",
        f"{_SET_ANGLES} in the driver: they must span what it sees.",
    ),
    "bearings_doubtful": (
        "The beams of {topic} lie over {factor:.2f} times the angle that is stated, as far as the scans "
        "show: they are read as stated.",
        f"{_SET_ANGLES} in the driver: they must span what it sees.",
    ),
}

_ODOMETRY: Mapping[str, Sentences] = {
    "odometry_jumps": (
        "The odometry jumps {times}, faster than any car.",
        "Make sure that only one node publishes it and that it is not reset while driving.",
    ),
    "odometry_rare": (
        "The odometry comes {rate:.1f} times a second, at up to {speed:.1f} m/s.",
        "Publish it at 20 Hz or more, so that the motion within a sweep is known.",
    ),
    "odometry_of_two_programs": (
        "The odometry alternates between two tracks, {times}: two programs publish it, of which the first is "
        "followed.",
        "Let only one node publish it, such as the driver or a filter.",
    ),
    "odometry_spikes": (
        "The odometry jumps away for a single sample, {times}: these are left out.",
        "See what disturbs its node, and that only one publishes it.",
    ),
    "odometry_by_speeds": (
        "The poses of {topic} stand still while its speeds do not: the pose is integrated from the speeds.",
        "",
    ),
    "odometry_without_orientation": (
        "No pose on {topic} is valid (its orientation is zero or not a number, or its position absurd): the "
        "pose is integrated from the speeds.",
        f"Make its node {_SET_QUATERNION}",
    ),
    "odometry_resets_by_speeds": (
        "The odometry on {topic} is set back to zero again and again: the pose is integrated from its "
        "speeds.",
        _RESET_BEFORE,
    ),
    "odometry_link_contested": (
        "Two programs publish the link {link} on {topic}, each another motion: it is not taken for odometry, "
        f"and {_BY_SCANS_ALONE}.",
        "Record with one of them only, such as the driver or a filter, not both.",
    ),
    "odometry_topic_stands": (
        "The poses of {topic} never change, while {link} on {link_topics} moves: the latter is the odometry.",
        "Find out why the topic stands still.",
    ),
    "odometry_link_stands": (
        "The link {link} on {topic} never changes though the car moves: the motion is read from {moving}.",
        "Find out why the odometry stands still, if it should not.",
    ),
    "no_odometry": (
        f"There is no odometry: {_BY_SCANS_ALONE}.{{solution}}",
        "Record the odometry topic too, or drive slowly and where there is much to see.",
    ),
    "no_odometry_link_moves": (
        "The link {link} on {topics} never changes: it is not taken for odometry, and "
        f"{_BY_SCANS_ALONE}.",
        "Record the odometry topic too, or drive slowly and where there is much to see.",
    ),
    "odometry_stuck": (
        _FAULTY_ODOMETRY,
        f"{_CARRIED} find out why its driver sends no motion, or name another topic {by_name('odom_topic')}.",
    ),
    "odometry_without_distance": (
        _FAULTY_ODOMETRY,
        f"{_CARRIED} make its node integrate the speed of the wheels too, in metres.",
    ),
    "odometry_without_turns": (
        _FAULTY_ODOMETRY,
        "Make its node integrate steering angle or gyroscope, or record an IMU.",
    ),
    "odometry_resets": (
        _FAULTY_ODOMETRY,
        f"{_RESET_BEFORE} A live node can read its speeds instead (the parameter odometry: twist).",
    ),
    "odometry_impossible": (
        _FAULTY_ODOMETRY,
        "Make sure that its node gives metres and radians, and that only one publishes it.",
    ),
    "odometry_turns_from_imu": (
        "The odometry on {topic} {fault}: turns are taken from the IMU.",
        "Make the odometry's node turn too.",
    ),
    "odometry_mirrored": (
        f"The odometry on {{topic}} does not go where its own yaw looks: {_NOT_USED}",
        "Make sure that its node does not exchange x and y, or change the sign of one of them (REP 103).",
    ),
    "turns_inverted": (
        "The scans turn left where the odometry turns right, and nothing shows which is wrong: the odometry "
        f"is not used, and {_BY_SCANS_ALONE}.",
        f"Correct the sign of the odometry's yaw; or, if the laser hangs upside down, give {_POSE} with the "
        "roll 3.1416.",
    ),
    "turns_disagree": (
        "The scans turn {ratio:.2f} times as far as the odometry on {topic}: the angles of one of them are "
        "wrong.",
        "Correct angle_increment in the laser's driver, or wheelbase, track or steering gain in the "
        "odometry's node.",
    ),
    "distances_disagree": (
        "The odometry on {topic} reports {ratio:.0%} of the distance that the scans show: it is corrected to "
        "that. If the ranges of {scans} are wrong instead{in_feet} the map is {size:.2f} times its true "
        "size.",
        "Measure a wall of the map. If it is right, correct wheel radius, gear or the gain from motor to "
        "speed in the odometry's node; if not, the unit of the ranges on {scans}, which are metres.",
    ),
    "signs_changed": (
        "The odometry on {topic} turns right where the scans turn left: its {what} read with the other sign, "
        "{why}.",
        "Correct the sign in the odometry's node: counter-clockwise is positive (REP 103).",
    ),
}

_CLOCKS: Mapping[str, Sentences] = {
    "clock_jumps": (
        "The stamps of the messages jump by {seconds} s while recording, because a clock was set: they are "
        "taken to go on as before.",
        _SET_BEFORE,
    ),
    "clock_drifts": (
        "The clock of {topic} {gains} {milliseconds:.0f} ms a second on that of {other}: by their stamps the "
        "two fit together less and less.",
        ONE_CLOCK,
    ),
    "clocks_apart": (
        "The clock of {topic} is {seconds:.2f} s {side} that of {other}, {evidence}: {done}.",
        ONE_CLOCK,
    ),
    "clocks_of_other_origins": (
        "The clocks of {topic} and {other} count from different origins, such as 1970 and power-on, "
        "{evidence}: {done}.",
        ONE_CLOCK,
    ),
    "odometry_lags": (
        "By its stamps the odometry is {milliseconds:.0f} ms {side} the scans, as the turns show: this is "
        "corrected.",
        ONE_CLOCK,
    ),
    "imu_lags": (
        "By its stamps the IMU is {milliseconds:.0f} ms {side} the scans, as the turns show: they are "
        "shifted.",
        ONE_CLOCK,
    ),
}

_IMU: Mapping[str, Sentences] = {
    "gyroscope_on_its_side": (
        "The yaw rate of the IMU is always {rate:g}, while it turns about another axis: it is mounted on its "
        "side, and not used.",
        "Publish on /tf_static how it is mounted.",
    ),
    "gyroscope_dead": (
        "The yaw rate of the IMU is always {rate:g}: its gyroscope is dead and not used.",
        "Make sure that its driver starts the gyroscope.",
    ),
    "gyroscope_contradicts": ("{contradiction}", "{remedy}"),
}

_PLACE: Mapping[str, Sentences] = {
    "place_unknown": (
        "The bag does not say where {sensor} sits on the car (no transform from base_link on /tf_static or "
        "/tf): it is taken to be at base_link.",
        f"Give {_POSE}, or record /tf_static.",
    ),
    "place_by_another_frame": (
        "No frame is called base_link: {sensor} is taken to sit on the car as it does on {base}, from which "
        "its transforms lead.",
        f"If the car is another frame, give {_POSE}.",
    ),
    "place_told_twice": (
        "The transforms put {sensor} at two places on the car: {other} and {place}. The latter is taken.",
        f"Publish it once only; until then give {_POSE}.",
    ),
    "place_of_two": (
        "The transforms put the laser of {topic} at two places on the car: {other} and {place}. The latter "
        "is taken, as scans and odometry show.",
        f"Publish it once only, or give {_POSE} as {{given}}.",
    ),
    "transforms_in_a_circle": (
        "The transforms go in a circle: by {link} {sensor} sits at {other}, by the others at {place}. The "
        "latter is taken.",
        f"Publish one way from the car to the sensor only; until then give {_POSE}.",
    ),
    "sensor_tilted": (
        "The sensor is tilted by {degrees:.0f}°: it is taken as level.",
        "Mount it level; else walls appear too far and the floor as a wall.",
    ),
    "laser_hangs_otherwise": (
        "Odometry and gyroscope turn left where the scans turn right: the laser is read as hanging {right}, "
        "although its transform ({source}) has it {told}. If both turn the wrong way, as wheels that take "
        "their turns from the gyroscope do, the map is its mirror image.",
        f"Correct the roll in the laser's transform, or give {_POSE} as {{read}}; if the transform is right, "
        "as {as_told}.",
    ),
    "laser_upside_down": (
        "The scans turn left where the odometry turns right: the laser is taken to hang upside down, at "
        "{place}. If the odometry's sign is wrong instead, the map is its mirror image.",
        f"Give {_POSE}, which decides it: {{hanging}} if it hangs upside down, {{upright}} if not.",
    ),
    "place_contradicted": (
        "The laser looks {told:.0f}° to the left by its place ({source}), but {shown:.0f}° by the directions "
        f"of travel of scans and odometry: the place is believed, the odometry is not used, and "
        f"{_BY_SCANS_ALONE}.",
        f"Correct the one that is wrong; if it is the place, give {_POSE} as {{place}}.",
    ),
    "place_turned": (
        "The laser looks {told:.0f}° to the left by its transform ({source}), but {shown:.0f}° by the scans, "
        "since the odometry drives along the axis of the robot: so it is read.",
        f"Correct the transform, or give {_POSE} as {{place}}.",
    ),
    "place_learned": (
        "Nothing says where the laser of {topic} sits on the car: it is taken to be at {place}, as scans and "
        "odometry show.",
        f"Measure it and give {_POSE} as {{given}}, or record /tf_static.",
    ),
}

_LIVE: Mapping[str, Sentences] = {
    "clock_set": ("The stamps of the {what} jumped by {seconds:+.1f} s: a clock was set.", _GOES_ON),
    "clock_set_back": (
        "The stamps of the {what} jumped by {seconds:+.1f} s: a clock was set back, or a bag starts again.",
        _GOES_ON,
    ),
    "lone_stamp": ("A stamp of the {what} was far from those before; the message was left out.", ""),
    "stamps_show_no_time": (
        "The stamps of the {what} show no time: the messages are taken as measured when they arrive.",
        "Restart the driver, or make it stamp its messages.",
    ),
    "clocks_disagree": (
        "The stamps of the {what} were {seconds:.1f} s {side} those of the {other}: that is corrected.",
        "Synchronize the clocks of the computers and sensors.",
    ),
    "beams_changed": ("The scans' number of beams changed to {beams}; the scans are used all the same.", ""),
    "scans_without_readings": (
        "The scans hold no readings (NaN, zero or below range_min): the laser is covered or broken.",
        "",
    ),
    "scans_see_nothing": (
        "The scans see nothing within {metres:.0f} m: the laser is covered or broken, or no wall is in its "
        "reach.",
        "",
    ),
    "scans_repeat": (
        "The scans repeat themselves to the last bit while the odometry moves: they are left out.",
        _REPEATED_BY,
    ),
    "poses_not_numbers": ("The odometry holds poses that are not numbers; they are left out.", ""),
    "samples_jump_away": (
        "The odometry jumps away for single samples, which are left out; make sure that only one node "
        "publishes it.",
        "",
    ),
    "poses_stand": (
        "The odometry's poses stand still while its speeds do not; set the parameter odometry to twist.",
        "",
    ),
    "odometry_hangs": (
        "The odometry repeats one pose while the scans move on: it is ignored until that changes.",
        f"{_CARRIED} find out why the odometry's driver hangs.",
    ),
    "lost": ("The scans do not fit the map where the car is taken to be: it may be lost.", ""),
    "laser_turned": ("{warning}", ""),
    "no_messages": (
        "Nothing has arrived on {topic} yet: is the driver running, and is the name right?",
        "",
    ),
    "messages_stopped": ("Nothing arrives on {topic} any more: {consequence}.", ""),
    "messages_of_strange_type": (
        "The messages on {topic} are of a type that is not supported: {types}.",
        "",
    ),
    "messages_of_other_type": (
        "Messages on {topic} of another type, {types}, are left out: publish one type on a topic.",
        "",
    ),
    "invalid_yaw_rates": (
        "Messages of the IMU hold no turn rates, by their covariance or as these are no numbers: they are "
        "left out.",
        "",
    ),
    "laser_moved": (
        "The transform of {laser} was changed: from now on it is taken to sit at {place} on {base} instead "
        "of {before}.",
        "",
    ),
    "place_stays": (
        "The map in progress keeps the old place of its laser: start a new one (--anew) with that.",
        "",
    ),
    "no_transform": (
        "No transform says where {laser} sits on {base}: it is taken to be there; publish the transform, or "
        "set the parameter laser_pose.",
        "",
    ),
    "no_transform_yet": (
        "No transform says yet where {laser} sits on {base}: it is taken to be where it was in the last run.",
        "",
    ),
}
"""Reported by nodes while the car drives."""

SENTENCES: Mapping[str, Sentences | Callable[..., Sentences]] = {
    **COUNTED,
    **_BAG,
    **_SCANS,
    **_ODOMETRY,
    **_CLOCKS,
    **_IMU,
    **_PLACE,
    **_LIVE,
}
