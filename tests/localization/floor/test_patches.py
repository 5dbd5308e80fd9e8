import tracemalloc

import numpy as np
import pytest

from racecar.localization.config import LocalizationConfig
from racecar.localization.floor import patches
from racecar.localization.floor.patches import patch_sizes, spread, strips
from racecar.localization.localizer import Localizer
from racecar.maps.geometry.se2 import IDENTITY
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid


@pytest.mark.parametrize("cells", [1, 40, 10**6])
def test_strips_change_nothing(cells: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(patches, "_CELLS", cells)
    labels = np.random.default_rng(0).integers(0, 7, (53, 11), dtype=np.int32)
    assert np.array_equal(patch_sizes(labels, 7), np.bincount(labels.ravel(), minlength=8))
    values = np.arange(8.0) ** 2
    assert np.array_equal(spread(values, labels), values[labels])
    rows = list(strips((53, 11), 4))
    assert np.array_equal(np.concatenate([np.arange(53)[part] for part in rows]), np.arange(53))
    assert all(part.start % 4 == 0 for part in rows)


@pytest.mark.slow
def test_a_map_of_a_huge_hall_takes_little_memory() -> None:
    """16 bytes a cell and some, and 200 MB of views; it was 110 bytes a cell."""
    cells = np.full((4000, 4000), FREE, dtype=np.int8)
    cells[[0, -1]], cells[:, [0, -1]], cells[2000, 100:3900] = OCCUPIED, OCCUPIED, OCCUPIED
    tracemalloc.start()
    Localizer(OccupancyGrid(cells, 0.05, IDENTITY), LocalizationConfig(), np.random.default_rng(0))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20 * cells.size + 200e6
