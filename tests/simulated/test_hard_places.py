"""Places and drives that are hard to map, and how true the maps are: the short ones, then the long ones."""

import numpy as np
import pytest

from tests.simulated.mapped_drives import MappedDrive, map_drive

SLIPPING = {"noise": "slight", "slip": 0.25, "max_speed": 6.0}


def assert_no_wrong_loop(drive: MappedDrive) -> None:
    """Where a drive drifts less than matches bridge, no loop is closed."""
    assert (drive.loop_errors < [0.25, 3.0]).all()


_OUTDOORS = {"laser": "outdoor", "max_speed": 2.0, "duration": 35.0}


def test_slipping_wheels_on_a_race_track() -> None:
    assert map_drive("track", close_loops=False, duration=6.0, seed=1, **SLIPPING).drift < 0.004


@pytest.mark.parametrize(("every", "max_speed"), [(1, 6.0), (6, 2.0)])
def test_a_race_track_without_wheels(every: int, max_speed: float) -> None:
    """Smooth bends show next to nothing of the motion along them; the slower laser is a cheap one's."""
    drive = map_drive(
        "track", noise="none", has_wheels=False, seed=1, max_speed=max_speed, every=every, range_noise=0.02
    )
    assert_no_wrong_loop(drive)
    assert drive.mean_relation_error() < 0.05


def test_length_of_a_bare_corridor() -> None:
    drive = map_drive("bare_corridor", noise="slight", seed=1, duration=60.0, every=4)
    assert drive.length_error < 0.003


def test_look_alike_corridors_close_no_wrong_loop() -> None:
    assert_no_wrong_loop(map_drive("twin_corridors", noise="slight", seed=1, every=4))


def test_people_leave_no_trace() -> None:
    """Of all cells that were ever hit, every tenth is a person; some places were looked at a single time."""
    drive = map_drive("building", noise="slight", seed=1, duration=24.0, walkers=8, every=3)
    assert drive.share_off_walls() < 0.0003


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
def test_slipping_wheels_for_a_longer_while(seed: int) -> None:
    assert map_drive("track", close_loops=False, duration=25.0, seed=seed, **SLIPPING).drift < 0.004


@pytest.mark.slow
@pytest.mark.parametrize("noise", ["none", "slight"])
def test_length_of_a_bare_corridor_there_and_back(noise: str) -> None:
    assert map_drive("bare_corridor", noise=noise, seed=2).length_error < 0.003


@pytest.mark.slow
@pytest.mark.parametrize("noise", ["slight", "full"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_wrong_loop_whatever_the_wheels_say(noise: str, seed: int) -> None:
    assert_no_wrong_loop(map_drive("twin_corridors", noise=noise, seed=seed))


@pytest.mark.slow
@pytest.mark.parametrize(("every", "range_noise"), [(1, 0.01), (1, 0.03), (4, 0.02), (6, 0.02)])
def test_a_building_without_wheels(every: int, range_noise: float) -> None:
    drive = map_drive(
        "building", has_wheels=False, seed=1, duration=150.0, every=every, range_noise=range_noise
    )
    assert_no_wrong_loop(drive)
    assert drive.mean_relation_error() < 0.03


@pytest.mark.slow
def test_people_leave_no_trace_in_a_longer_drive() -> None:
    drive = map_drive("building", noise="slight", seed=1, duration=180.0, walkers=8)
    assert drive.share_off_walls() < 0.0003


@pytest.mark.slow
@pytest.mark.parametrize("noise", ["slight", "full"])
@pytest.mark.parametrize(
    ("plan", "duration"), [("long_track", None), ("twin_corridors", 700.0), ("building", 1200.0)]
)
def test_kilometres(plan: str, duration: float | None, noise: str) -> None:
    drive = map_drive(plan, noise=noise, seed=1, duration=duration, every=2)
    assert np.hypot(*np.diff(drive.truth[:, :2], axis=0).T).sum() > 1000.0
    assert_no_wrong_loop(drive)
    assert drive.mean_relation_error() < 0.05


def test_on_open_ground_few_beams_tell_how_far_the_wheels_drove() -> None:
    drive = map_drive("campus", **_OUTDOORS, noise="full", seed=2, beams_every=3)
    assert drive.drift < 0.03


def test_a_bare_corridor_that_is_driven_on_while_scans_are_missing() -> None:
    drive = map_drive(
        "bare_corridor", noise="full", steering=True, seed=1, max_speed=3.0, duration=20.0, scan_gaps=5.0
    )
    assert drive.length_error < 0.05


def test_a_car_that_is_carried_over_open_ground_is_told() -> None:
    drive = map_drive("campus", **_OUTDOORS, noise="slight", seed=1, carried=8.0, carrier=True)
    assert drive.result.quality.verdict != "good"


def test_a_car_that_was_carried_along_bare_walls_is_told_where_its_wheels_were_left_out() -> None:
    drive = map_drive("bare_corridor", carried=10.0, seed=909, duration=30.0)
    assert drive.drift > 0.1  # nothing shows how far
    assert drive.result.quality.verdict == "doubtful"
    assert "the car seems to have stood" in drive.result.quality.summary
