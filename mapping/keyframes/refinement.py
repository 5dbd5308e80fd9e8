"""Refinement: match every scan between keyframes with the optimized keyframes around it."""

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
"""Factor by which scans must fit better from another guess to prefer it. Chosen by judgement: along an arc or
a bare corridor they fit nearly everywhere, and best where the car did not move at all."""
_NEAR_IN_TIME = -3, -2, -1, 0, 1, 2, 3, 4
"""Keyframes that a scan is matched with, relative to the one it follows. Chosen by judgement: as many before
as after."""
_NEAR_IN_SPACE = 6
"""Number of nearest keyframes of other passes that it is matched with. Measured: with these, intel fell from
0.033 to 0.012 m, fr079 from 0.063 to 0.042 m."""
_OTHER_PASS = 6
"""Keyframes along the path beyond which one belongs to another pass. Chosen by judgement: slightly more than
those near in time."""
_SPATIAL_CANDIDATES = 30
"""Nearest keyframes among which those of other passes are selected. Chosen by judgement: those of a few
passes."""
_INITIAL_DISTANCE = 0.3
"""Initial correspondence distance in metres. Chosen by judgement: dead reckoning errs less between
keyframes."""
_KERNEL_WIDTH = 0.08
"""Residual in metres at which a point's weight is a quarter. Chosen by judgement: twice as much as between
keyframes, whose guesses are better."""
_PRIOR_INFORMATION = np.diag([5.0, 5.0, 20.0])
"""Prior of the guess: its position weighs as many points on a wall along each axis, its heading as many a
metre away. Chosen by judgement: along a bare corridor it decides, elsewhere some hundred points do."""
_POOR_SHARE = 0.7
"""Share of the usual overlap below which a scan fits poorly and is matched again from its neighbours' poses.
Chosen by judgement: less than what doors and people take."""
_USUAL_AMONG = 101
"""Scans in the running median of the usual overlap; odd. Chosen by judgement: some seconds of driving."""
_CHUNK = 1000
"""Scans prepared and matched at once, so that memory does not grow with the drive."""
_WORKERS = 2
"""Threads at most, so that one chunk is prepared while another is matched."""


def keyframe_of(scans: NDArray[np.int64], keyframe_scans: NDArray[np.int64]) -> NDArray[np.int64]:
    """(M,) keyframes that scans (M,) are, or follow; (K,) are the scans of the keyframes."""
    return np.searchsorted(keyframe_scans, scans, side="right") - 1


def guess_scans(
    stamps: NDArray[np.int64],
    scans: NDArray[np.int64],
    keyframe_from_scan: Pose,
    keyframe_scans: NDArray[np.int64],
    keyframe_from_next: Pose,
    map_from_keyframe: Pose,
) -> Pose:
    """Dead-reckoned poses (M, 3) of some scans (M,), from their motion (M, 3) since the keyframe each
    follows. All scans of the drive have stamps (N,) in nanoseconds; K of them, (K,), are keyframes.

    The motion (K - 1, 3) between keyframes was measured likewise. Its error is distributed over the time
    between both like the variance of an unmeasured velocity, independent from scan to scan: a pause gets most
    of it.
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
    """Poses (N, 3) of scans, given points in the laser frame, the keyframe each follows and guesses."""
    among = _Keyframes(keyframes, map_from_keyframe)
    poses = np.array(guesses)

    def refine(first: int) -> None:
        part = slice(first, first + _CHUNK)
        poses[part] = _refine_chunk(points[part], after_keyframe[part], guesses[part], among)

    with ThreadPoolExecutor(thread_count(_WORKERS)) as pool:
        list(pool.map(refine, range(0, len(points), _CHUNK)))
    return poses


class _Keyframes:
    """The keyframes that scans are matched with."""

    def __init__(self, store: ScanStore, map_from_keyframe: Pose) -> None:
        self.store, self.map_from_keyframe = store, map_from_keyframe
        self._kept = np.flatnonzero(store.is_kept)
        self._tree = cKDTree(map_from_keyframe[self._kept, :2])

    def partners(self, after_keyframe: NDArray[np.int64], guesses: Pose) -> list[NDArray[np.int64]]:
        """Keyframes to match each scan (N) with: those around the one (N,) it follows, and those of other
        passes that are close to its guess (N, 3) and face alike."""
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
    """Match the scans of some rows (G,) with their partner keyframes, starting from guesses (G, 3)."""
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
        both_ways=False,  # half the work, for errors equal to a tenth of a millimetre
    )


def _follow_neighbours(
    matches: Matches, guesses: Pose, matching: Callable[[NDArray[np.int64], Pose], Matches]
) -> Pose:
    """Poses (N, 3) of scans, after matching poorly fitting ones again from their neighbours' poses.

    A car that is held or pushed turns unnoticed by its wheels, and all later guesses are off.
    """
    poses, weights = matches.poses.copy(), matches.weight.copy()
    among = min(_USUAL_AMONG, 2 * len(poses) - 1)  # SciPy 1.15 returns zeros for a longer window
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
