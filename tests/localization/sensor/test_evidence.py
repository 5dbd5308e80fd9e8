"""What a scan is worth beside others, and by how much of it the map explains."""

import pytest

from racecar.localization.sensor.config import EvidenceConfig
from racecar.localization.sensor.evidence import worth

CONFIG = EvidenceConfig()
FAR = 10.0 * CONFIG.independent_after


def test_an_independent_scan_that_the_map_explains_counts_in_full() -> None:
    assert worth(FAR, 1.0, CONFIG) == worth(float("inf"), CONFIG.usual_share, CONFIG) == 1.0


@pytest.mark.parametrize("scans", [2, 7, 40])
def test_scans_along_a_path_count_together_as_often_as_they_are_independent(scans: int) -> None:
    along = 3.0 * CONFIG.independent_after
    assert scans * worth(along / scans, 1.0, CONFIG) == pytest.approx(min(scans, 3.0))


def test_scans_of_a_car_that_stands_do_not_count() -> None:
    assert worth(0.0, 1.0, CONFIG) == 0.0


def test_a_scan_of_which_little_fits_counts_less() -> None:
    worths = [worth(FAR, fitting, CONFIG) for fitting in (1.0, 0.8, 0.6, 0.4, 0.2)]
    assert worths[:2] == [1.0, 1.0]
    assert worths[1] > worths[2] > worths[3] > worths[4] > 0.0
    assert worths[3] < 0.2
    assert worths[4] < 0.02
