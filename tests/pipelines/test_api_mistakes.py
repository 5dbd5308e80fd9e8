"""What one gets wrong in Python: wrong types, names, units and order are one sentence with the remedy."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import racecar
from racecar.maps.errors import UserError
from tests.pipelines.bag_samples import write_bag

BEAMS = np.linspace(-2.0, 2.0, 100)


@dataclass(frozen=True)
class World:
    """What calls are made with; as untyped as a notebook."""

    bag: Path
    run: Any
    api: Any = racecar

    @property
    def localizer(self) -> Any:
        return self.api.Localizer(self.run.grid)

    def scan(self, **other: object) -> Any:
        usual = {
            "stamp": 10**9,
            "bearings": BEAMS,
            "ranges": np.full(100, 2.0),
            "time_offsets": np.zeros(100),
            "base_from_laser": np.zeros(3),
            "max_range": 10.0,
        }
        return self.api.Scan(**{**usual, **other})


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> World:
    bag = write_bag(tmp_path_factory.mktemp("mistakes") / "drive.bag")
    run = racecar.map_bag(bag)
    run.save(bag.parent / "run")
    return World(bag, run)


ZERO = np.zeros(3)
CELLS = np.zeros((2, 2), dtype=np.int8)

MISTAKES: dict[str, tuple[Callable[[World], object], str]] = {
    # types
    "no bag": (lambda w: w.api.map_bag(None), "map_bag takes str or Path or BagReader as 'bag', not None."),
    "list of bags": (lambda w: w.api.map_bag([w.bag]), "as 'bag', not list."),
    "config of a number": (lambda w: w.api.map_bag(w.bag, config=0.1), "Config or str or Path or Mapping"),
    "mapper of a dict": (lambda w: w.api.Mapper({"resolution": 0.1}), "takes MappingConfig as 'config'"),
    "mapper of a whole config": (
        lambda w: w.api.Mapper(w.api.Config()),
        "as 'config', not Config",
    ),
    "localizer of a name": (lambda w: w.api.Localizer("building"), "takes OccupancyGrid as 'grid', not str"),
    "localizer of a run": (lambda w: w.api.Localizer(w.run), "takes OccupancyGrid as 'grid', not MapRun"),
    "odometry as scan": (
        lambda w: w.api.Mapper().add_scan(w.api.Odometry(0, ZERO, ZERO)),
        "add_scan takes Scan as 'scan', not Odometry",
    ),
    "scan as odometry": (lambda w: w.localizer.add_odometry(w.scan()), "takes Odometry as 'odometry'"),
    "words as ranges": (
        lambda w: w.scan(ranges="far"),
        "should be an array (100,) of numbers",
    ),
    "seed of words": (lambda w: w.api.localize_bag(w.bag, w.run, seed="first"), "int as 'seed', not str"),
    "save without a folder": (
        lambda w: w.run.save(),
        "MapRun.save lacks 'folder': call ",
    ),
    "laser of words": (lambda w: w.api.map_bag(w.bag, laser_pose="front"), "give x, y and yaw in metres"),
    "true as seed": (lambda w: w.api.localize_bag(w.bag, w.run, seed=True), "int as 'seed', not bool."),
    "plot of a file": (lambda w: w.run.plot("map.png"), "MapRun.plot takes nothing"),
    "number as topic": (
        lambda w: w.api.map_bag(w.bag, scan_topic=3),
        "takes str or Sequence as 'scan_topic', not int.",
    ),
    "setting of a number": (
        lambda w: w.api.map_bag(w.bag, config={1: 2}),
        "'1': it should be the name of a setting, not 1",
    ),
    # shapes and values
    "occupied or not": (
        lambda w: w.api.OccupancyGrid(CELLS == 0, 0.05, ZERO),
        "true or false; give percent occupied, such as 100 * cells",
    ),
    "one cell": (lambda w: w.run.grid.center_of([3, 4]), "Cells of a grid should be an array (N, 2)"),
    "points in space": (lambda w: w.run.grid.cell_of(np.zeros((4, 3))), "(N, 2), not one of shape (4, 3)"),
    "bearings that are unknown": (
        lambda w: w.scan(bearings=np.full(100, np.nan)),
        "a bearing of nan is no angle: give radians.",
    ),
    "negative seed": (lambda w: w.api.localize_bag(w.bag, w.run, seed=-1), "The seed is -1; give 0 or more."),
    "no such mode": (
        lambda w: w.api.save_map(w.run.grid, "map.yaml", mode="grey"),
        "must be one of trinary, scale, raw",
    ),
    "ranges of another length": (
        lambda w: w.scan(ranges=np.ones(99)),
        "not one of shape (99,)",
    ),
    "flat cells": (
        lambda w: w.api.OccupancyGrid(CELLS[0], 0.05, ZERO),
        "(N, N), not one of shape (2,)",
    ),
    "cells of probabilities": (
        lambda w: w.api.OccupancyGrid(np.full((2, 2), 0.5), 0.05, ZERO),
        "The cells of a grid, in percent, should be an array (N, N) of whole numbers",
    ),
    "cells of an image": (
        lambda w: w.api.OccupancyGrid(np.full((2, 2), 254), 0.05, ZERO),
        "give percent occupied, 0 to 100, and -1 for unknown",
    ),
    "half a pose": (
        lambda w: w.api.localize_bag(w.bag, w.run, initial_pose=(1, 2)),
        "not three finite numbers",
    ),
    "pose that is not known": (lambda w: w.localizer.set_pose([np.nan, 0, 0]), "not three finite numbers"),
    "stamps of seconds": (
        lambda w: w.api.Trajectory(np.array([0.1, 0.2]), np.zeros((2, 3))),
        "The stamps of a trajectory, in nanoseconds, should be an array (N,) of whole numbers",
    ),
    "fewer poses than stamps": (
        lambda w: w.api.Trajectory(np.arange(3), np.zeros((2, 3))),
        "an array (3, 3), not one of shape (2, 3)",
    ),
    "a pose of four": (
        lambda w: w.api.Odometry(0, np.zeros(4), ZERO),
        "(3,), not one of shape (4,)",
    ),
    "covariance of a number": (lambda w: w.localizer.set_pose(ZERO, 0.1), "give 3 x 3 finite numbers"),
    "no such setting": (lambda w: w.api.MappingConfig(resolutoin=0.1), "did you mean 'resolution'"),
    "bad setting": (lambda w: w.api.MappingConfig(resolution="fine"), "it should be a number, not 'fine'"),
    "no such section": (lambda w: w.api.map_bag(w.bag, config={"mappin": {}}), "did you mean 'mapping'"),
    "true for a number": (
        lambda w: w.api.map_bag(w.bag, config={"sensors": {"min_range": True}}),
        "'sensors.min_range': it should not be true or false",
    ),
    "a setting that is changed": (
        lambda w: setattr(w.api.MappingConfig(), "resolution", 0.1),
        "make another, such as MappingConfig(resolution=0.1)",
    ),
    "setting without a name": (lambda w: w.api.LocalizationConfig(500), "LocalizationConfig(particles=4000)"),
    # names
    "topic misspelt": (lambda w: w.api.map_bag(w.bag, scan_topics="/scan"), "did you mean 'scan_topic'?"),
    "laser by another name": (
        lambda w: w.api.BagReader(w.bag, lidar_pose=ZERO),
        "BagReader has no argument 'lidar_pose'; did you mean 'laser_pose'?",
    ),
    "mapper misspelt": (lambda w: w.api.Mapper(conf=None), "did you mean 'config'?"),
    "scan without its place": (lambda w: w.api.Scan(0, BEAMS, BEAMS, BEAMS), "lacks 'base_from_laser'"),
    "no such topic": (lambda w: w.api.map_bag(w.bag, scan_topic="/scna"), "/scan"),
    "no such shipped map": (lambda w: w.api.load_map("bulding"), "building"),
    # order
    "map before bag": (
        lambda w: w.api.localize_bag(w.run, w.bag),
        "localize_bag takes str or Path or BagReader as 'bag', not MapRun; a MapRun is for 'map', as in "
        "localize_bag(bag, map, ...).",
    ),
    "folder of the map before bag": (
        lambda w: w.api.localize_bag(w.bag.parent / "run", w.bag),
        "holds a map, not a bag: name the bag first, then the map",
    ),
    "path before grid": (lambda w: w.api.save_map("map.yaml", w.run.grid), "save_map takes Raster as 'grid'"),
    "config without its name": (
        lambda w: w.api.map_bag(w.bag, {"mapping": {}}),
        "map_bag takes bag in this order, and by name: config, ",
    ),
    "pose without a map": (lambda w: w.api.map_bag(w.bag, initial_pose=ZERO), "give both, or neither"),
    "reading what is closed": (lambda w: w.api.map_bag(closed(w)), "is closed; open the bag again."),
    "options after opening": (
        lambda w: mapped_when_open(w, scan_topic="/scan"),
        "is open already: give scan_topic to it",
    ),
    # units
    "pose in degrees": (
        lambda w: w.api.localize_bag(w.bag, w.run, initial_pose=(0, 0, 90)),
        "give radians, 1.5708 if these are degrees",
    ),
    "set in degrees": (
        lambda w: w.localizer.set_pose([0, 0, 180]),
        "3.1416 if these are degrees",
    ),
    "laser in degrees": (
        lambda w: w.api.map_bag(w.bag, laser_pose=(0.2, 0, 90)),
        "1.5708 if these are degrees",
    ),
    "laser in millimetres": (
        lambda w: w.api.map_bag(w.bag, laser_pose=(270, 0, 0)),
        "give metres, 0.27 if these are millimetres",
    ),
    "bearings in degrees": (lambda w: w.scan(bearings=np.rad2deg(BEAMS)), "2.0000 if these are degrees"),
    "max_range in millimetres": (lambda w: w.scan(max_range=30_000), "give metres, 1000 at most"),
    "stamp in seconds": (lambda w: w.scan(stamp=1.5), "Scan takes int as 'stamp', not float"),
    "resolution in millimetres": (
        lambda w: w.api.OccupancyGrid(CELLS, 50, ZERO),
        "give the metres that a cell measures",
    ),
    "start in nanoseconds": (lambda w: w.api.map_bag(w.bag, start=1.7e18), "cannot start at"),
}


def mapped_when_open(world: World, **options: object) -> object:
    with world.api.BagReader(world.bag) as reader:
        return world.api.map_bag(reader, **options)


def closed(world: World) -> Any:
    with world.api.BagReader(world.bag) as reader:
        return reader


@contextmanager
def one_sentence(words: str) -> Iterator[None]:
    with pytest.raises(UserError) as caught:
        yield
    sentence = str(caught.value)
    assert words in sentence
    assert "\n" not in sentence
    assert sentence[-1] in ".?"
    assert "pydantic" not in sentence


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_one_sentence(world: World, name: str) -> None:
    call, words = MISTAKES[name]
    with one_sentence(words):
        call(world)


def test_lists_and_numbers_of_numpy_do_as_well_as_arrays(world: World) -> None:
    scan = world.scan(
        stamp=np.int64(5), ranges=[1.0] * 100, base_from_laser=[0, 0, 0], max_range=np.float32(9.0)
    )
    assert scan.ranges.dtype == np.float64
    odometry = world.api.Odometry(0, [1, 2, 3], (0, 0, 0))
    assert odometry.odom_from_base.tolist() == [1.0, 2.0, 3.0]
    grid = world.api.OccupancyGrid([[0, 100], [-1, 50]], 1, [0, 0, 0])
    assert (grid.cells.dtype, grid.shape) == (np.int8, (2, 2))


def test_arrays_stay_the_same_ones(world: World) -> None:
    ranges = np.ones(100)
    assert world.scan(ranges=ranges).ranges is ranges


def test_a_fault_inside_is_no_mistake_of_the_caller(monkeypatch: pytest.MonkeyPatch, world: World) -> None:
    def fails(*_: object, **__: object) -> None:
        raise TypeError("a fault of ours")

    monkeypatch.setattr("racecar.pipelines.runs.mapping_run.build_map", fails)
    with pytest.raises(TypeError, match="a fault of ours"):
        racecar.map_bag(world.bag)
