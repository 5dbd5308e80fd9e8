"""Pictures of the motion model: the cloud along a path without corrections by scans."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.maps.geometry.se2 import Pose, chained
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.pipelines.experiments.experiment import ExperimentSettings
from racecar.pipelines.experiments.filters import with_motion_noise, with_particles
from racecar.pipelines.experiments.page import TRUTH, Page
from racecar.pipelines.files.pictures.colors import BLUE, GREEN, ORANGE, VERMILLION
from racecar.pipelines.runs.parallel_runs import ParallelRuns
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

_SPEED, _RADIUS, _PERIOD = 2.0, 2.0, 0.05
"""Metres per second, metres, seconds."""
_SECTIONS = ((2.0, 0.0), (np.pi * _RADIUS / 2, 1.0 / _RADIUS), (1.0, 0.0))
"""Metres of path, and turn per metre: straight, a quarter of a circle, straight."""
_SHOWN_AFTER = (0.0, 2.0, 3.6, 5.1, 6.1)
"""Metres of path."""
_PARTICLES = 1000
_TINY = 1e-9
"""Metres and radians: practically no noise, for a filter that divides by it."""


def motion_model(settings: ExperimentSettings, parallel: ParallelRuns) -> Page:
    """The same drive without noise and with noise."""
    config = settings.localization
    variants = {"without noise": with_motion_noise(config, _TINY), "with noise": config}
    arguments = [(variant, settings.seed) for variant in variants.values()]
    driven = parallel.here.run("Motion model", drive_blindly, arguments)
    clouds = dict(zip(variants, driven, strict=True))
    deviations = {name: [_deviation(cloud) for cloud in of_one] for name, of_one in clouds.items()}
    page = Page(
        "Motion model: what odometry noise does to the particles",
        f"A car drives {_length():.1f} m: straight, a quarter turn to the left of {_RADIUS:g} m radius, "
        f"and straight. {_PARTICLES} particles start in one point and follow its odometry; the scans are "
        "empty, so nothing pulls them together. Without noise they stay in one point, and a filter "
        "could never recover from an error of the odometry. With the noise in use the cloud grows along "
        "the path and bends, because an error in heading becomes one in place later on.",
    )
    page.table(
        "Standard deviation of the particles' place along the path",
        ("noise", *(f"after {distance:g} m (m)" for distance in _SHOWN_AFTER)),
        [(name, *(f"{value:.3f}" for value in values)) for name, values in deviations.items()],
    )
    page.figures |= {
        name: {"distance_m": _SHOWN_AFTER, "deviation_m": values} for name, values in deviations.items()
    }
    _draw(page, clouds)
    return page


def _draw(page: Page, all_clouds: Mapping[str, list[Pose]]) -> None:
    shows = (
        f"{_PARTICLES} particles at the start and after some metres of path, without noise, and with the "
        "noise in use."
    )
    with page.draw("motion-model", 126, shows, legend_columns=3) as figure:
        panels = figure.subplots(len(all_clouds), 1, sharex=True, sharey=True)
        for axes, (name, clouds) in zip(panels, all_clouds.items(), strict=True):
            axes.plot(*_path()[:, :2].T, color=TRUTH, linewidth=0.8, label="odometry", zorder=4)
            for cloud, distance, color in zip(
                clouds, _SHOWN_AFTER, (TRUTH, BLUE, GREEN, ORANGE, VERMILLION), strict=True
            ):
                size = 6.0 if _deviation(cloud) < 0.01 else 1.5
                style = {"color": color, "markersize": size, "markeredgewidth": 0, "rasterized": True}
                axes.plot(*cloud[:, :2].T, ".", **style, zorder=5)
                axes.plot([], [], ".", color=color, markersize=6.0, label=f"{distance:g} m")
            axes.set(title=name, aspect="equal", ylabel="y (m)")
        panels[-1].set_xlabel("x (m)")


def drive_blindly(settings: LocalizationConfig, seed: int) -> list[Pose]:
    """The particles after each of the lengths shown."""
    settings = with_particles(settings, _PARTICLES)
    localizer = Localizer(_empty_floor(), settings, np.random.default_rng([seed, 6]))
    path = _path()
    localizer.set_pose(path[0], np.diag([_TINY, _TINY, _TINY]) ** 2)
    wanted = [round(distance / (_SPEED * _PERIOD)) for distance in _SHOWN_AFTER]
    clouds = []
    for index, (odometry, scan) in enumerate(_messages(path)):
        localizer.add_odometry(odometry)
        localizer.add_scan(scan)
        if index in wanted:
            clouds.append(localizer.particles()[0])
    return clouds


def _messages(path: Pose) -> Iterator[tuple[Odometry, Scan]]:
    """Odometry, and scans without any return."""
    bearings: NDArray[np.float64] = np.linspace(-1.0, 1.0, 11)
    nothing = np.full(len(bearings), np.nan)
    for index, pose in enumerate(path):
        stamp = round(index * _PERIOD * 1e9)
        yield (
            Odometry(stamp, pose, np.array([_SPEED, 0.0, 0.0])),
            Scan(stamp, bearings, nothing, np.zeros(len(bearings)), np.zeros(3), 10.0),
        )


def _path() -> Pose:
    """(T, 3) poses, one per period."""
    step = _SPEED * _PERIOD
    turns = np.concatenate([np.full(round(length / step), bend * step) for length, bend in _SECTIONS])
    return chained(np.column_stack([step * np.cos(turns / 2), step * np.sin(turns / 2), turns]))


def _length() -> float:
    return sum(length for length, _ in _SECTIONS)


def _empty_floor() -> OccupancyGrid:
    cells = np.full((160, 180), FREE, dtype=np.int8)
    cells[0, 0] = OCCUPIED  # not seen by any scan: a map without any wall is rejected
    return OccupancyGrid(cells, 0.1, np.array([-6.0, -6.0, 0.0]))


def _deviation(cloud: Pose) -> float:
    return float(np.sqrt(cloud[:, :2].var(axis=0).sum()))
