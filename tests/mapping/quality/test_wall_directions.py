"""Whether walls hold a scan in all directions."""

import numpy as np

from racecar.mapping.quality.statistics import weakest_direction
from racecar.sensors.matching.scan_store import PreparedScan
from tests.sensors.worlds import CORRIDOR, ROOM, store_of

PLACE = np.array([[-1.0, 0.0, 0.3]])


def test_a_room_holds_and_a_bare_corridor_does_not() -> None:
    assert weakest_direction(store_of(ROOM, PLACE))[0] > 0.1
    assert weakest_direction(store_of(CORRIDOR, PLACE))[0] < 0.01


def test_a_scan_that_saw_nothing_is_not_held() -> None:
    store = store_of(ROOM, PLACE)
    store.add(PreparedScan(np.zeros((0, 2), dtype=np.float32), np.zeros((0, 2), dtype=np.float32)))
    assert weakest_direction(store).tolist()[1] == 0.0
