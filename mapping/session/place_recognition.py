"""Where on an earlier map does a drive lie, when nothing is known of it?

Each submap of the drive is sought all over the earlier map and with any heading. What is found is believed
once several submaps along the path tell the same story, and no other story is told by nearly as many.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from racecar.mapping.loops.loop_closure import RIVAL_SHARE, Hypothesis, LoopCloser
from racecar.mapping.loops.submap import Submap
from racecar.mapping.matching.correlative_search import Fit, LikelihoodPyramid, Window, search
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose

PLACE_SPACING = 3.0
PLACE_TURN = np.deg2rad(60.0)
WINDOW = Window(4.0, np.pi)
RADIUS = 20.0
MOVING_POINTS = 150
MIN_SCORE = 0.5
"""Who comes the other way sees half of the same walls; what fits by chance is refuted afterwards."""
SAME_PLACE = 1.0
SAME_HEADING = np.deg2rad(10.0)
WORKERS = 2
MIN_SUPPORT = 4
"""Submaps that must tell the same story, 2 m of path from one to the next."""
CLEAR_MAJORITY = 2


def recognize(loops: LoopCloser, earlier: int, poses: Pose) -> list[Hypothesis]:
    """Hypotheses of one story, that tell where the submaps after the ``earlier`` first ones lie on those.

    The poses (K, 3) of both groups are in frames that have nothing to do with each other. Empty when the
    place was not recognized.
    """
    whole = [submap for submap in loops.submaps if loops.is_whole(submap)]
    places = _places([submap for submap in whole if submap.index < earlier], poses)
    pyramids = [LikelihoodPyramid(place.points(loops.store, poses), RADIUS) for place in places]
    found: list[Hypothesis] = []
    for moving in [submap for submap in whole if submap.index >= earlier]:
        found += _seek(loops, moving, places, pyramids, poses)
        story = _told_by_most(loops, found, poses)
        if story:
            return story
    return []


def _places(submaps: list[Submap], poses: Pose) -> list[Submap]:
    """One submap of each place and heading."""
    chosen: list[Submap] = []
    for submap in submaps:
        if not any(
            _is_near(poses[other.middle], poses[submap.middle], PLACE_SPACING, PLACE_TURN) for other in chosen
        ):
            chosen.append(submap)
    return chosen


def _seek(
    loops: LoopCloser, moving: Submap, places: list[Submap], pyramids: list[LikelihoodPyramid], poses: Pose
) -> list[Hypothesis]:
    """The verified places of one submap: the best, and all that score nearly as high."""
    points = moving.sample(loops.store, poses, MOVING_POINTS)
    if points is None:
        return []

    def fit(pyramid: LikelihoodPyramid) -> Fit | None:
        return search(pyramid, points, IDENTITY, WINDOW, MIN_SCORE, RIVAL_SHARE)

    with ThreadPoolExecutor(WORKERS) as pool:
        fits = [
            (found, place)
            for found, place in zip(pool.map(fit, pyramids), places, strict=True)
            if found is not None and found.rival == 0.0
        ]
    fits.sort(key=lambda found: -found[0].score)
    hypotheses: list[Hypothesis] = []
    seen: list[Pose] = []
    for found, place in fits:
        map_from_moving = compose(poses[place.middle], found.pose)
        is_known = any(_is_near(other, map_from_moving, SAME_PLACE, SAME_HEADING) for other in seen)
        if found.score < RIVAL_SHARE * fits[0][0].score or is_known:
            continue
        seen.append(map_from_moving)
        hypothesis = loops.verified(place, moving, poses, found.pose, WINDOW.reach)
        if hypothesis is not None:
            hypotheses.append(hypothesis)
    return hypotheses


def _told_by_most(loops: LoopCloser, found: list[Hypothesis], poses: Pose) -> list[Hypothesis]:
    """The hypotheses of the story that clearly most submaps tell; empty while there is none."""
    stories = [[g for g in found if g is h or loops.agree(g, h, poses)] for h in found]
    support = [len({h.moving.middle for h in story}) for story in stories]
    if not support or max(support) < MIN_SUPPORT:
        return []
    winner = stories[int(np.argmax(support))]
    others = [n for n, story in zip(support, stories, strict=True) if not any(h in winner for h in story)]
    return winner if max(support) >= CLEAR_MAJORITY * max(others, default=0) else []


def _is_near(a: Pose, b: Pose, distance: float, turn: float) -> bool:
    apart = between(a, b)
    return bool(np.hypot(apart[0], apart[1]) < distance and abs(apart[2]) < turn)
