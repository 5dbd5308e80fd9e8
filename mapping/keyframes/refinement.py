"""Refinement: every scan between keyframes finds its place among the optimized keyframes around it."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.spatial import cKDTree

from racecar.mapping.keyframes.first_pass import ALIKE_TURN
from racecar.mapping.keyframes.placement import SAME_GUESS
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose, wrap_angle
from racecar.sensors.matching.scan_matching import Matches, Pairings, match
from racecar.sensors.matching.scan_store import ScanStore, prepare_scan
from racecar.sensors.threads import thread_count

_CLEARLY_BETTER = 1.25
"""By what factor scans must fit better from another guess until it wins. By judgement: along an arc or a bare
corridor they fit nearly everywhere, and best where the car did not move at all."""
_NEAR_IN_TIME = -3, -2, -1, 0, 1, 2, 3, 4
"""Keyframes with which a scan is matched, counted from the one it follows. By judgement: as many before as
after."""
_NEAR_IN_SPACE = 6
"""Keyframes of other passes with which it is matched, the nearest. Measured: with these, intel fell from
0.033 to 0.012 m, fr079 from 0.063 to 0.042 m."""
_OTHER_PASS = 6
"""Keyframes along the path, beyond which one counts as near in space and not in time. By judgement: some more
than those near in time."""
_SPATIAL_CANDIDATES = 30
"""Keyframes about a scan, the nearest, among which those of other passes are looked for. By judgement: those
of a few passes."""
_INITIAL_DISTANCE = 0.3
"""Metres within which partners are looked for at first. By judgement: between two keyframes dead reckoning
misses less."""
_KERNEL_WIDTH = 0.08
"""Metres off its line at which a point weighs a quarter. By judgement: twice as much as between keyframes,
whose guesses are better."""
_PRIOR_INFORMATION = np.diag([5.0, 5.0, 20.0])
"""What the guess of a position counts for along each axis, in points on a wall, and that of a heading, in
points a metre away. By judgement: along a bare corridor it decides, elsewhere some hundred points do."""
_POOR_SHARE = 0.7
"""Share of the usual overlap below which a scan fits poorly and is tried again from where its neighbours lie.
By judgement: less than what doors and people take."""
_USUAL_AMONG = 101
"""Scans about one, over which the usual overlap is the median; odd. By judgement: some seconds of driving."""
_CHUNK = 1000
"""Scans that are prepared and matched at once, so that a long drive needs the memory of few at a time."""
_WORKERS = 2
"""Threads at most, so that one chunk is prepared while another is matched."""


def keyframe_of(scans: NDArray[np.int64], keyframe_scans: NDArray[np.int64]) -> NDArray[np.int64]:
    """The keyframes (M,) that some scans (M,) are, or come after; (K,) are the scans that keyframes are."""
    return np.searchsorted(keyframe_scans, scans, side="right") - 1


def guess_scans(
    stamps: NDArray[np.int64],
    scans: NDArray[np.int64],
    keyframe_from_scan: Pose,
    keyframe_scans: NDArray[np.int64],
    keyframe_from_next: Pose,
    map_from_keyframe: Pose,
) -> Pose:
    """Poses (M, 3) of some scans (M,) from the motion (M, 3) since the keyframe each follows, by dead
    reckoning; all scans of the drive were taken at stamps (N,), nanoseconds, and K of them, (K,), are the
    keyframes.

    The motion (K - 1, 3) from one keyframe to the next was measured in the same way. What it missed by is
    spread over the time between the two as the variance is of a velocity that was not measured, which is
    independent from scan to scan: most of it goes to a pause.
    """
    after = keyframe_of(scans, keyframe_scans)
    guesses = compose(map_from_keyframe[after], keyframe_from_scan)
    has_next = after < len(keyframe_scans) - 1
    before = after[has_next]
    missed = between(
        compose(map_from_keyframe[before], keyframe_from_next[before]), map_from_keyframe[before + 1]
    )
    variance = np.append(0.0, np.cumsum((np.diff(stamps) * 1e-9) ** 2))
    begin, end = variance[keyframe_scans[before]], variance[keyframe_scans[before + 1]]
    share = (variance[scans[has_next]] - begin) / np.where(end > begin, end - begin, 1.0)
    guesses[has_next] = compose(guesses[has_next], share[:, None] * missed)
    return guesses


def refine_scans(
    points: Sequence[NDArray[np.float32]],
    after_keyframe: NDArray[np.int64],
    guesses: Pose,
    keyframes: ScanStore,
    map_from_keyframe: Pose,
) -> Pose:
    """Poses (N, 3) of scans, from their points in the laser frame, the keyframe each follows and guesses."""
    among = _Keyframes(keyframes, map_from_keyframe)
    poses = np.array(guesses)

    def refine(first: int) -> None:
        part = slice(first, first + _CHUNK)
        poses[part] = _refine_chunk(points[part], after_keyframe[part], guesses[part], among)

    with ThreadPoolExecutor(thread_count(_WORKERS)) as pool:
        list(pool.map(refine, range(0, len(points), _CHUNK)))
    return poses


class _Keyframes:
    """The keyframes among which scans find their places."""

    def __init__(self, store: ScanStore, map_from_keyframe: Pose) -> None:
        self.store, self.map_from_keyframe = store, map_from_keyframe
        self._kept = np.flatnonzero(store.is_kept)
        self._tree = cKDTree(map_from_keyframe[self._kept, :2])

    def partners(self, after_keyframe: NDArray[np.int64], guesses: Pose) -> list[NDArray[np.int64]]:
        """Of each scan (N), those about the keyframe (N,) it follows; and of other passes, those near its
        guess (N, 3) that face alike."""
        around = after_keyframe[:, None] + np.array(_NEAR_IN_TIME)
        are_there = (around >= 0) & (around < len(self.store))
        most = min(_SPATIAL_CANDIDATES, len(self._kept))
        nearest: NDArray[np.int64] = self._kept[self._tree.query(guesses[:, :2], k=np.arange(1, most + 1))[1]]
        turned = np.abs(wrap_angle(self.map_from_keyframe[nearest, 2] - guesses[:, 2:3]))
        fit = (np.abs(nearest - after_keyframe[:, None]) > _OTHER_PASS) & (turned < ALIKE_TURN)
        return [
            np.concatenate([in_time[is_there], in_space[fits][:_NEAR_IN_SPACE]])
            for in_time, is_there, in_space, fits in zip(around, are_there, nearest, fit, strict=True)
        ]


def _refine_chunk(
    points: Sequence[NDArray[np.float32]],
    after_keyframe: NDArray[np.int64],
    guesses: Pose,
    keyframes: _Keyframes,
) -> Pose:
    scans = ScanStore(len(points))
    for cloud in points:
        scans.add(prepare_scan(cloud.astype(np.float64)))
    matching = partial(_match, keyframes.partners(after_keyframe, guesses), scans, keyframes)
    matches = matching(np.arange(len(points)), guesses)
    return _follow_neighbours(matches, guesses, matching)


def _match(
    partners: Sequence[NDArray[np.int64]],
    scans: ScanStore,
    keyframes: _Keyframes,
    rows: NDArray[np.int64],
    guesses: Pose,
) -> Matches:
    """Match the scans of some rows (G,), each to its partners among the keyframes, from guesses (G, 3)."""
    counts = [len(partners[row]) for row in rows]
    fixed = np.concatenate([partners[row] for row in rows]).astype(np.int64)
    pairs = np.column_stack([fixed, np.repeat(rows, counts)])
    starts = np.concatenate([[0], np.cumsum(counts)])
    pairings = Pairings(starts, pairs, keyframes.map_from_keyframe[fixed], np.zeros((len(fixed), 3)))
    return match(
        guesses,
        pairings,
        keyframes.store,
        scans,
        initial_distance=_INITIAL_DISTANCE,
        kernel_width=_KERNEL_WIDTH,
        prior_information=_PRIOR_INFORMATION,
        both_ways=False,  # half the work, for errors that are the same to a tenth of a millimetre
    )


def _follow_neighbours(
    matches: Matches, guesses: Pose, matching: Callable[[NDArray[np.int64], Pose], Matches]
) -> Pose:
    """Poses (N, 3) of scans, each that fits poorly tried again from where the ones beside it came to lie.

    A car that is held or pushed turns unnoticed by its wheels, and all guesses after that are off.
    """
    poses, weights = matches.poses.copy(), matches.weight.copy()
    among = min(_USUAL_AMONG, 2 * len(poses) - 1)  # SciPy 1.15 gives zeros for a longer window
    usual = median_filter(matches.overlap, among, mode="nearest")
    poor = np.flatnonzero(matches.overlap < _POOR_SHARE * usual)
    for rows, beside in ((poor[poor > 0], -1), (poor[poor < len(poses) - 1][::-1], 1)):
        for row in rows:
            guess = compose(poses[row + beside], between(guesses[row + beside], guesses[row]))
            if not are_apart(guess, poses[row], SAME_GUESS):
                continue
            again = matching(np.array([row]), guess[None])
            if again.weight[0] > _CLEARLY_BETTER * weights[row]:
                poses[row], weights[row] = again.poses[0], again.weight[0]
    return poses
