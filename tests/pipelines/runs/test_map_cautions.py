"""What is told of a map before its figures are believed."""

from pathlib import Path

import numpy as np
import pytest

from racecar.localization.verdict.drive_quality import DriveVerdict
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.map_files import load_map, save_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.run_report import Inputs
from racecar.pipelines.runs.map_cautions import cautions_of_fit, cautions_of_path
from racecar.pipelines.runs.mapping_drive import MappingDrive


@pytest.mark.parametrize(
    ("verdict", "told"),
    [(DriveVerdict.LOCALIZED, "much has changed"), (DriveVerdict.UNCERTAIN, "it is the wrong map")],
)
def test_why_scans_fit_poorly_agrees_with_the_verdict(verdict: DriveVerdict, told: str) -> None:
    (caution,) = cautions_of_fit(0.3, verdict)
    assert told in caution
    assert "Only 30% of the scans' end points" in caution
    assert cautions_of_fit(0.6, verdict) == []


def test_what_the_verdict_says_itself_is_not_said_twice() -> None:
    assert cautions_of_fit(0.3, DriveVerdict.LOST) == []


@pytest.mark.parametrize(("shift", "told"), [(0.0, 0), (0.5, 1), (30.0, 1)])
def test_a_path_that_is_not_of_the_map_beside_it_is_told(tmp_path: Path, shift: float, told: int) -> None:
    cells = np.full((40, 100), FREE, dtype=np.int8)
    cells[:10] = OCCUPIED
    save_map(OccupancyGrid(cells, 0.05, np.zeros(3)), tmp_path / "map.yaml")
    along = np.linspace(0.5, 4.5, 20)
    driven = np.column_stack([along, np.full(20, 0.8 - shift), np.zeros(20)])
    drive = MappingDrive(Inputs(), lambda: Trajectory(np.arange(20), driven))
    cautions = cautions_of_path(load_map(tmp_path), drive)
    assert len(cautions) == told
    assert all("100% of the path" in caution for caution in cautions)
