"""Ways that a car may have gone without a trace."""

import numpy as np
import pytest

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.judgement import judge
from racecar.mapping.quality.map_quality import MapQuality, Verdict
from racecar.mapping.quality.unseen_motion import unseen_motion
from racecar.maps.geometry.se2 import between
from tests.mapping.sessions import as_two_recordings, chain, plain_map
from tests.sensors.worlds import CORRIDOR, ROOM, store_of

PATH = np.column_stack([np.linspace(-3.0, 2.0, 11), np.zeros(11), np.zeros(11)])
INFORMATION = np.diag([1e4, 1e4, 1e5])
BARE = np.ones(len(PATH), dtype=np.bool_)


def stood_in(step: int, seconds: float) -> np.ndarray:
    """Seconds of the keyframes of a drive at 1 m/s that stood in one step."""
    at = 0.5 * np.arange(len(PATH))
    at[step + 1 :] += seconds
    return at


def drive(
    seconds: np.ndarray, *loops: Constraint, walls: np.ndarray = CORRIDOR, wheels: bool = True
) -> FinishedMap:
    steps = chain(PATH, INFORMATION, "odometry" if wheels else "scan_matching")
    return plain_map(store_of(walls, PATH), PATH, [*steps, *loops], seconds)


def unseen(map_: FinishedMap, are_bare: np.ndarray = BARE) -> list[float]:
    edges = GraphEdges.of(map_.session.constraints, map_.poses)
    return unseen_motion(map_, edges, are_bare).tolist()


def verdict(map_: FinishedMap) -> MapQuality:
    return judge(map_, QualityConfig())


def test_a_stand_between_bare_walls_counts_by_the_usual_pace() -> None:
    assert unseen(drive(stood_in(4, 8.0))) == pytest.approx([0, 0, 0, 0, 8.0, 0, 0, 0, 0, 0])


@pytest.mark.parametrize(
    ("map_", "are_bare"),
    [
        (drive(stood_in(0, 8.0)), BARE),  # every car stands before it drives
        (drive(stood_in(4, 8.0)), ~BARE),
        (as_two_recordings(drive(stood_in(4, 8.0)), 5), BARE),  # the next one begins then
    ],
)
def test_no_stand_is_unseen_that_something_tells_of(map_: FinishedMap, are_bare: np.ndarray) -> None:
    assert not any(unseen(map_, are_bare))


@pytest.mark.parametrize("step", [0, 4])
def test_without_wheels_nothing_tells_whether_the_car_stood(step: int) -> None:
    assert max(unseen(drive(stood_in(step, 8.0), wheels=False))) == pytest.approx(8.0)


def test_a_loop_that_ends_before_the_stand_tells_nothing_of_it() -> None:
    loop = Constraint(0, 4, between(PATH[0], PATH[4]), INFORMATION, "loop_closure")
    assert max(unseen(drive(stood_in(4, 8.0), loop))) == pytest.approx(8.0)


def test_a_loop_between_bare_walls_tells_nothing() -> None:
    are_bare = np.isin(np.arange(len(PATH)), [2, 4, 5, 9])
    loop = Constraint(2, 9, between(PATH[2], PATH[9]), INFORMATION, "loop_closure")
    assert max(unseen(drive(stood_in(4, 8.0), loop), are_bare)) == pytest.approx(8.0)
    are_bare[[2, 9]] = False  # a loop that spans the stand
    assert not any(unseen(drive(stood_in(4, 8.0), loop), are_bare))


def test_a_map_with_such_a_stand_is_doubtful_and_says_when_it_was() -> None:
    quality = verdict(drive(stood_in(4, 8.0)))
    assert quality.verdict == Verdict.DOUBTFUL
    assert "as long as it usually takes to go 8 m" in quality.summary
    assert any("at 2 to 10 s, the car may have moved unseen" in why for why in quality.reasons)


@pytest.mark.parametrize("map_", [drive(stood_in(4, 1.0)), drive(stood_in(4, 8.0), walls=ROOM)])
def test_a_short_stand_or_one_in_a_room_leaves_it_good(map_: FinishedMap) -> None:
    assert verdict(map_).verdict == Verdict.GOOD
