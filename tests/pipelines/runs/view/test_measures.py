"""Speed, fit and doubt over the time of a run."""

from dataclasses import replace

import numpy as np
import pytest

from racecar.maps.trajectory import Trajectory
from racecar.pipelines.runs.view.measures import Measure, measures_of
from racecar.pipelines.runs.view.scene import Scene, Sight
from tests.pipelines.studio.test_look_page import a_run


def by_name(scene: Scene) -> dict[str, Measure]:
    return {measure.name: measure for measure in measures_of(scene)}


def seeing_the_wall(scene: Scene, off: float) -> Scene:
    """Scans of the lower wall of the room, by a car that is so far off in the second half."""
    poses = scene.trajectory.map_from_base
    wall = np.column_stack([np.linspace(-1.0, 1.0, 50), np.full(50, 0.075 - 3.0)])
    moved = poses + np.where(np.arange(len(poses)) >= len(poses) // 2, off, 0.0)[:, None] * [0.0, 1.0, 0.0]
    trajectory = Trajectory(scene.trajectory.stamps, moved)
    sights = [Sight(int(stamp), wall.astype(np.float32)) for stamp in trajectory.stamps]
    return replace(scene, trajectory=trajectory, sights=sights)


def test_a_drive_has_its_speed_over_the_whole_time() -> None:
    speed = by_name(a_run())["speed"]
    assert speed.seconds[[0, -1]] == pytest.approx([0.0, 4.0])
    np.testing.assert_allclose(speed.values, 1.0, rtol=1e-6)


def test_scans_beside_the_walls_do_not_fit() -> None:
    fit = by_name(seeing_the_wall(a_run(), 1.0))["fit"]
    np.testing.assert_array_equal(fit.values[:20], 100.0)
    np.testing.assert_array_equal(fit.values[20:], 0.0)
    assert fit.worst == 20


def test_doubt_is_the_deviation_of_poses_or_else_the_residual_of_matches_of_this_drive() -> None:
    scene = a_run()
    np.testing.assert_allclose(by_name(scene)["doubt"].values, 100.0 * np.sqrt(0.02))
    matched = replace(
        scene,
        covariances=np.zeros((0, 3, 3)),
        misses=np.array([0.3, 0.1, 0.2]),
        match_stamps=np.array([2 * 10**9, 0, 10**9]),
    )
    doubt = by_name(matched)["doubt"]
    np.testing.assert_allclose(doubt.seconds, [0.0, 1.0])
    np.testing.assert_allclose(doubt.values, [20.0, 30.0])


def test_a_run_without_scans_map_or_certainties_has_only_its_speed() -> None:
    assert set(by_name(Scene("", "", a_run().trajectory))) == {"speed"}
