"""Refinement: every scan between keyframes finds its place among the settled keyframes around it."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.spatial import cKDTree

from racecar.mapping.keyframes.keyframe_tracking import CLEARLY_BETTER, differ
from racecar.mapping.matching.scan_matching import Matches, Pairings, match
from racecar.mapping.matching.scan_store import ScanStore, prepare_scan
from racecar.maps.geometry.se2 import Pose, between, compose, wrap_angle

NEAR_IN_TIME = (-3, -2, -1, 0, 1, 2, 3, 4)
NEAR_IN_SPACE = 6
_SPATIAL_CANDIDATES = 30
_MAX_TURN = 1.0
_PRIOR = np.diag([5.0, 5.0, 20.0])
_WIDEST = 0.3
_KERNEL_WIDTH = 0.08
"""Wider than between keyframes, whose guesses are better."""
_POOR_SHARE = 0.7
_USUAL_AMONG = 101
"""Scans."""
_CHUNK = 1000
_WORKERS = 2


def guess_scans(
    stamps: NDArray[np.int64],
    keyframe_from_scan: Pose,
    after_keyframe: NDArray[np.int64],
    keyframe_from_next: Pose,
    keyframe_stamps: NDArray[np.int64],
    map_from_keyframe: Pose,
) -> Pose:
    """Poses (M, 3) of scans from the motion (M, 3) since the keyframe each follows, by dead reckoning.

    The motion (K - 1, 3) from one keyframe to the next was measured in the same way; what it missed by is
    spread over the time between the two: most of it over a pause, in which nothing was measured. Stamps (M,)
    and those of the keyframes (K,) are in nanoseconds.
    """
    guesses = compose(map_from_keyframe[after_keyframe], keyframe_from_scan)
    has_next = after_keyframe < len(keyframe_stamps) - 1
    before = after_keyframe[has_next]
    missed = between(
        compose(map_from_keyframe[before], keyframe_from_next[before]), map_from_keyframe[before + 1]
    )
    since = stamps[has_next] - keyframe_stamps[before]
    share = since / np.maximum(keyframe_stamps[before + 1] - keyframe_stamps[before], 1)
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
    held = np.flatnonzero(keyframes.is_kept)
    tree = cKDTree(map_from_keyframe[held, :2])
    poses = np.array(guesses)

    def refine(first: int) -> None:
        part = slice(first, first + _CHUNK)
        poses[part] = _refine_chunk(
            points[part], after_keyframe[part], guesses[part], keyframes, map_from_keyframe, held, tree
        )

    with ThreadPoolExecutor(_WORKERS) as pool:  # one chunk is prepared while another is matched
        list(pool.map(refine, range(0, len(points), _CHUNK)))
    return poses


def _refine_chunk(
    points: Sequence[NDArray[np.float32]],
    after_keyframe: NDArray[np.int64],
    guesses: Pose,
    keyframes: ScanStore,
    map_from_keyframe: Pose,
    held: NDArray[np.int64],
    tree: cKDTree,
) -> Pose:
    scans = ScanStore(len(points))
    for cloud in points:
        scans.add(prepare_scan(cloud.astype(np.float64)))
    partners = [
        np.concatenate(pair)
        for pair in zip(
            _near_in_time(after_keyframe, len(keyframes)),
            _near_in_space(after_keyframe, guesses, map_from_keyframe, held, tree),
            strict=True,
        )
    ]
    matching = partial(_match, partners, scans, keyframes, map_from_keyframe)
    matches = matching(np.arange(len(points)), guesses)
    return _follow_neighbours(matches, guesses, matching)


def _match(
    partners: Sequence[NDArray[np.int64]],
    scans: ScanStore,
    keyframes: ScanStore,
    map_from_keyframe: Pose,
    rows: NDArray[np.int64],
    guesses: Pose,
) -> Matches:
    """Match the scans of some rows (G,), each to its partners among the keyframes, from guesses (G, 3)."""
    counts = [len(partners[row]) for row in rows]
    fixed = np.concatenate([partners[row] for row in rows]).astype(np.int64)
    pairs = np.column_stack([fixed, np.repeat(rows, counts)])
    starts = np.concatenate([[0], np.cumsum(counts)])
    pairings = Pairings(starts, pairs, map_from_keyframe[fixed], np.zeros((len(fixed), 3)))
    return match(
        guesses,
        pairings,
        keyframes,
        scans,
        initial_distance=_WIDEST,
        kernel_width=_KERNEL_WIDTH,
        prior_information=_PRIOR,
        both_ways=False,  # half the work, for errors that are the same to a tenth of a millimetre
    )


def _follow_neighbours(
    matches: Matches, guesses: Pose, matching: Callable[[NDArray[np.int64], Pose], Matches]
) -> Pose:
    """Poses (N, 3) of scans, each that fits poorly tried again from where the ones beside it came to lie.

    A car that is held or pushed turns without its wheels telling, and all guesses after that are off.
    """
    poses, weights = matches.poses.copy(), matches.weight.copy()
    among = min(_USUAL_AMONG, 2 * len(poses) - 1)  # SciPy 1.15 gives zeros for a longer window
    usual = median_filter(matches.overlap, among, mode="nearest")
    poor = np.flatnonzero(matches.overlap < _POOR_SHARE * usual)
    for rows, beside in ((poor[poor > 0], -1), (poor[poor < len(poses) - 1][::-1], 1)):
        for row in rows:
            guess = compose(poses[row + beside], between(guesses[row + beside], guesses[row]))
            if not differ(guess, poses[row]):
                continue
            again = matching(np.array([row]), guess[None])
            if again.weight[0] > CLEARLY_BETTER * weights[row]:
                poses[row], weights[row] = again.poses[0], again.weight[0]
    return poses


def _near_in_time(after_keyframe: NDArray[np.int64], count: int) -> list[NDArray[np.int64]]:
    around = after_keyframe[:, None] + np.array(NEAR_IN_TIME)
    return [row[(row >= 0) & (row < count)] for row in around]


def _near_in_space(
    after_keyframe: NDArray[np.int64],
    guesses: Pose,
    map_from_keyframe: Pose,
    held: NDArray[np.int64],
    tree: cKDTree,
) -> list[NDArray[np.int64]]:
    """Keyframes of other passes, near and facing alike, of the ``held`` (H,), whose places the tree has."""
    most = min(_SPATIAL_CANDIDATES, len(held))
    nearest: NDArray[np.int64] = held[tree.query(guesses[:, :2], k=np.arange(1, most + 1))[1]]
    turned = np.abs(wrap_angle(map_from_keyframe[nearest, 2] - guesses[:, 2:3]))
    other_pass = np.abs(nearest - after_keyframe[:, None]) > len(NEAR_IN_TIME) - 2
    return [
        row[fits][:NEAR_IN_SPACE]
        for row, fits in zip(nearest, other_pass & (turned < _MAX_TURN), strict=True)
    ]
