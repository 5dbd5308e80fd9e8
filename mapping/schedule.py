"""Intervals of the mapper's periodic work, all in keyframes."""

WINDOW = 40
"""Most recent keyframes that are optimized during the drive. Chosen by judgement: slightly more than the
farthest predecessor matched."""
WINDOW_INTERVAL = 10
"""Keyframes between such optimizations, and between trimming scans. Chosen by judgement: some 3 m of path."""
FINAL_ROUNDS = 10
"""Maximum number of times the whole drive is matched again at the end. Chosen by judgement: on simulated open
ground, where few scans show how far the wheels drove, the path is settled by then."""
SETTLED_BEND = 0.015
"""Mean shift in metres, by one more round, of the farthest keyframe each is matched with, below which the
path is settled. Measured: 0.006 m after the first round on aces, 0.01 to 0.9 m on simulated open ground."""
RECENT_LOOPS = 10
"""Loops closed since a keyframe, after which it is fixed when the next loop is optimized, so that a loop
costs the same all day."""
LAG_INTERVAL = 10
"""Keyframes between updates of the wheels' clock lag. Chosen by judgement: some 3 m of path."""
CALIBRATION_WINDOW = 1000
"""Most recent steps used to calibrate the wheels. Chosen by judgement: some 300 m of path, at constant
cost."""
PACKING_INTERVAL = 100
"""Keyframes between trimming keyframes and compacting what they and the scans between them saw. Chosen by
judgement: some 30 m of path."""
_CALIBRATION_INTERVAL = 50
"""Keyframes between wheel calibrations, fewer if these are farther apart than required. Chosen by judgement:
some 15 m of path. Where a scan came once in 2 s and this was 100 m, wheels that had been right to 1 cm for 80
m were overruled by a corridor that looks like another, and the map was off by 28 m."""


def calibrates_at(index: int, stretch: float) -> bool:
    """Whether to calibrate the wheels at a keyframe that is ``stretch`` times the required distance from the
    last."""
    return index % max(round(_CALIBRATION_INTERVAL / max(stretch, 1.0)), 1) == 0
