"""A map is drawn turned, cropped, shifted and without chosen scans; its walls say which turn is straight."""

import numpy as np
import pytest
from numpy.typing import NDArray

from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.grid.rendering import Rays, render
from racecar.mapping.session.drawing import DrawnMap, Views, draw_map
from racecar.mapping.session.wall_direction import wall_direction
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose, transform_points
from racecar.maps.grid.occupancy_grid import UNKNOWN
from racecar.sensors.matching.scan_store import PreparedScan, ScanStore
from tests.mapping.sessions import one_drive
from tests.sensors.worlds import ROOM, points_at, store_of

RESOLUTION, TURN = 0.05, 0.3
PATH = np.array([[x, 0.2, 0.1 * x] for x in np.arange(-1.0, 1.0, 0.1)])
MAP_FROM_WORLD = np.array([3.0, -1.0, TURN])
STORE = store_of(ROOM, PATH)


def views() -> Views:
    """Of a room that lies turned in its map; a keyframe in a second."""
    rays = [Rays.to(points, len(points)) for points in (points_at(ROOM, pose) for pose in PATH)]
    poses: Pose = compose(MAP_FROM_WORLD, PATH)
    return Views(rays, poses, np.arange(len(PATH), dtype=np.float64), one_drive(len(PATH)), len(PATH))


def drawn(rendering: RenderingConfig, *, keep_frame: bool = False) -> DrawnMap:
    with_specks = rendering.model_copy(update={"largest_speck": 0.0})
    return draw_map(views(), STORE, RESOLUTION, with_specks, keep_frame=keep_frame)


def settings(**values: object) -> RenderingConfig:
    return RenderingConfig.model_validate(values)


def test_by_default_the_frame_is_that_of_the_scans() -> None:
    plain = drawn(settings())
    assert plain.drawn_from_map is None
    assert plain.disregarded == ()
    expected = render(
        views().rays, views().map_from_laser, views().drives, RESOLUTION, RenderingConfig()
    ).in_one_piece()
    np.testing.assert_array_equal(plain.grid.map_from_grid, expected.map_from_grid)
    np.testing.assert_array_equal(plain.grid.cells, expected.cells)


def test_walls_run_along_the_axes_and_the_origin_has_no_yaw() -> None:
    straight = drawn(settings(turn="walls"))
    assert straight.drawn_from_map is not None
    assert straight.grid.map_from_grid[2] == 0.0
    assert straight.drawn_from_map[2] == pytest.approx(-TURN, abs=np.deg2rad(0.2))
    returns = np.concatenate([points_at(ROOM, pose) @ rotation(pose[2]).T + pose[:2] for pose in PATH])
    moved = transform_points(compose(straight.drawn_from_map, MAP_FROM_WORLD), returns)
    rows, columns = straight.grid.cell_of(moved).T
    assert np.mean(straight.grid.cells[rows, columns] > 65) > 0.95


def rotation(yaw: float) -> NDArray[np.float64]:
    return np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])


def test_a_box_is_cut_out_and_shows_what_the_whole_map_shows_there() -> None:
    whole, cut = drawn(settings()).grid, drawn(settings(crop=[2.0, -2.0, 3.5, 0.0])).grid
    assert cut.cells.shape == (40, 30)
    np.testing.assert_allclose(cut.map_from_grid, [2.0, -2.0, 0.0], atol=1e-9)
    row, column = np.rint((cut.map_from_grid - whole.map_from_grid)[1::-1] / RESOLUTION).astype(int)
    np.testing.assert_array_equal(cut.cells, whole.cells[row : row + 40, column : column + 30])


def test_what_was_driven_is_cut_out() -> None:
    driven = drawn(settings(crop="driven", driven_margin=1.0)).grid
    centres = driven.center_of(np.argwhere(driven.cells != UNKNOWN))
    path = views().path
    nearest = np.min(np.hypot(*(centres[:, None] - path).transpose(2, 0, 1)), axis=1)
    assert nearest.max() < 1.0 + RESOLUTION
    assert len(centres) > 0.9 * (np.pi + 2.0 * 1.9) / RESOLUTION**2
    assert min(driven.cells.shape) < 3.2 / RESOLUTION


@pytest.mark.parametrize("turn", [0.0, "walls"])
def test_the_corner_becomes_the_origin(turn: object) -> None:
    shifted = drawn(settings(turn=turn, origin="corner"))
    np.testing.assert_allclose(shifted.grid.map_from_grid, 0.0, atol=1e-12)
    assert shifted.drawn_from_map is not None
    x, y = transform_points(shifted.drawn_from_map, views().path).T
    rows, columns = shifted.grid.cell_of(np.column_stack([x, y])).T
    assert np.all(shifted.grid.cells[rows, columns] == drawn(settings(turn=turn)).grid.cells[rows, columns])


def test_a_place_of_the_turned_map_becomes_the_origin() -> None:
    shifted = drawn(settings(turn=0.2, origin=[1.0, 2.0]))
    assert shifted.drawn_from_map is not None
    np.testing.assert_allclose(shifted.drawn_from_map, [-1.0, -2.0, 0.2])


def test_scans_of_chosen_times_draw_nothing() -> None:
    last = drawn(settings(left_out=[[0.0, 5.0], [8.0, 18.0]]))
    chosen = [6, 7, 19]
    expected = render(
        [views().rays[k] for k in chosen],
        views().map_from_laser[chosen],
        one_drive(len(chosen)),
        RESOLUTION,
        RenderingConfig(),
    ).in_one_piece()
    np.testing.assert_array_equal(last.grid.cells > 50, expected.cells > 50)


@pytest.mark.parametrize(
    ("values", "words"),
    [({"crop": [90.0, 90.0, 95.0, 95.0]}, "Nothing was seen"), ({"left_out": [[0.0, 99.0]]}, "all scans")],
)
def test_what_leaves_nothing_is_not_followed_and_told(values: dict[str, object], words: str) -> None:
    all_of_it = drawn(settings(**values))
    assert words in all_of_it.disregarded[0]
    np.testing.assert_array_equal(all_of_it.grid.cells, drawn(settings()).grid.cells)


def test_a_frame_that_is_kept_is_kept_and_told() -> None:
    kept = drawn(settings(turn="walls", origin="corner"), keep_frame=True)
    assert kept.drawn_from_map is None
    assert "carried on in the frame" in kept.disregarded[0]
    np.testing.assert_array_equal(kept.grid.cells, drawn(settings()).grid.cells)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"turn": "north"}, "radians"),
        ({"turn": 90}, "radians"),
        ({"crop": [0, 0, 1]}, "a box"),
        ({"crop": [5, 0, 1, 5]}, "a box"),
        ({"crop": "seen"}, "a box"),
        ({"origin": [1]}, "x and y"),
        ({"left_out": [[5, 4]]}, "spans"),
        ({"left_out": [[5]]}, "spans"),
        ({"free_threshold": 0.7}, "below occupied_threshold"),
    ],
)
def test_settings_that_cannot_be_are_refused_in_a_clause(values: dict[str, object], words: str) -> None:
    with pytest.raises(UserError, match=words):
        settings(**values)


AT = np.array([[0.0, 0.0, 0.3], [0.5, -0.4, 2.0], [-0.6, 0.3, -2.4]])


def degrees_off(direction: float, turn: float) -> float:
    return abs((np.rad2deg(direction - turn) + 45.0) % 90.0 - 45.0)


@pytest.mark.parametrize("turn", [0.0, 0.3, 0.78, -0.5, 2.9])
def test_walls_are_found_whatever_way_they_run(turn: float) -> None:
    moved: Pose = compose([1.0, 2.0, turn], AT)
    direction = wall_direction(store_of(ROOM, AT), moved)
    assert direction is not None
    assert -np.pi / 4 <= direction < np.pi / 4
    assert degrees_off(direction, turn) < 0.1


def test_lines_that_run_elsewhere_do_not_count() -> None:
    """A third of all lines lie anyhow, a fifth along another wing, and normals scatter."""
    rng = np.random.default_rng(5)
    main = 0.31 + rng.integers(0, 4, 2000) * np.pi / 2
    angles = np.concatenate([main, np.full(800, 0.75), rng.uniform(-np.pi, np.pi, 1200)])
    angles += rng.normal(0.0, np.deg2rad(1.5), len(angles))
    store = ScanStore()
    for part in np.split(rng.permutation(angles), 20):
        points = np.column_stack([np.linspace(1.0, 2.0, len(part)), np.zeros(len(part))])
        normals = np.column_stack([np.cos(part), np.sin(part)])
        store.add(PreparedScan(points.astype(np.float32), normals.astype(np.float32)))
    direction = wall_direction(store, np.zeros((20, 3)))
    assert direction is not None
    assert degrees_off(direction, 0.31) < 0.2


def test_without_lines_there_is_no_direction() -> None:
    store = ScanStore()
    store.add(PreparedScan(np.zeros((0, 2), np.float32), np.zeros((0, 2), np.float32)))
    assert wall_direction(store, IDENTITY[None]) is None
