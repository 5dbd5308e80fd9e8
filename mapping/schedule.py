"""How often the mapper does what it does not do at each keyframe; all counts are of keyframes."""

WINDOW = 40
"""The latest keyframes, that are optimized while the drive goes on. By judgement: a little over the farthest
that one is tied to."""
WINDOW_INTERVAL = 10
"""After how many keyframes they are optimized, and scans are trimmed. By judgement: some 3 m of path."""
FINAL_ROUNDS = 10
"""How often, at most, the whole drive is matched again at the end. By judgement: on simulated open ground,
where few scans show how far the wheels drove, the path is settled by then."""
SETTLED_BEND = 0.015
"""Metres by which, on average, one more round shifts the farthest keyframe that each is tied to, below which
the path is settled. Measured: 0.006 m after the first round on aces, 0.01 to 0.9 m on simulated open
ground."""
RECENT_LOOPS = 10
"""Loops closed since a keyframe, after which it is held where it is when the next loop strains the map, so
that a loop costs the same all day."""
LAG_INTERVAL = 10
"""After how many keyframes the lag of the wheels' clock is learned. By judgement: some 3 m of path."""
CALIBRATION_WINDOW = 1000
"""The latest keyframe steps by which wheels are calibrated. By judgement: some 300 m of path, at a cost that
does not grow."""
PACKING_INTERVAL = 100
"""After how many keyframes these are trimmed, and what they and the scans between them saw is packed. By
judgement: some 30 m of path."""
_CALIBRATION_INTERVAL = 50
"""After how many keyframes the wheels are calibrated anew, and after fewer where these lie farther apart than
they need to. By judgement: some 15 m of path. Where a scan came once in 2 s and this was 100 m, wheels that
had been right to 1 cm for 80 m were overruled by a corridor that looks like another, and the map was off by
28 m."""


def calibrates_at(index: int, stretch: float) -> bool:
    """Whether the wheels are calibrated at a keyframe, that lies ``stretch`` times as far from the one before
    as keyframes need to."""
    return index % max(round(_CALIBRATION_INTERVAL / max(stretch, 1.0)), 1) == 0
