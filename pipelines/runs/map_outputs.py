"""The files that a mapping run writes: a new one is a module that writes it, and an entry of this list."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.quality.map_quality import DoubtfulSegment
from racecar.mapping.session.session import Session
from racecar.maps.grid.edits import edited
from racecar.maps.grid.thinning import thinned
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.maps.map_files import MOST_PIXELS, as_written, load_map, save_map, save_map_image
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.edits_file import MapEdits, save_edits
from racecar.pipelines.files.filter_masks import save_filter_masks
from racecar.pipelines.files.g2o import save_g2o
from racecar.pipelines.files.optional_packages import is_installed, left_out, require
from racecar.pipelines.files.point_map import require_open3d, save_point_map
from racecar.pipelines.files.report import REPORT_FILE, Report
from racecar.pipelines.files.session_file import SESSION_FILE, save_session
from racecar.pipelines.files.tum import save_tum
from racecar.pipelines.files.wall_drawings import save_walls_dxf, save_walls_svg
from racecar.pipelines.runs.map_cautions import cautions_of_edits, cautions_of_size


@dataclass(frozen=True, eq=False)
class WrittenMap:
    """What is written, and where to; all of it lies in one frame."""

    session: Session
    grid: TiledGrid
    rendering: RenderingConfig
    """The settings by which the grid is written."""
    trajectory: Trajectory | None
    """None where it is not known."""
    doubtful: Sequence[DoubtfulSegment]
    """What of the path something speaks against."""
    edits: MapEdits
    """Those that are drawn over the grid; in this frame."""
    title: str
    folder: Path
    caution: str = ""
    """Why the map may be wrong, where it is not good."""

    @cached_property
    def walls(self) -> list[NDArray[np.float64]]:
        """Polylines (N, 2) in metres, of the map as its files hold it."""
        from racecar.maps.grid.wall_lines import wall_lines  # few want it, and it takes a while to load

        return wall_lines(load_map(self.folder))


@dataclass(frozen=True)
class MapOutputKind:
    """Some files of a mapping run."""

    files: tuple[str, ...]
    """The names of those that every map has."""
    write: Callable[[WrittenMap], None]
    """Write them. Raises UserError when the place cannot be written to."""
    only_on_request: bool = False
    """Whether they are written only when their first file is asked for."""
    require: Callable[[], object] | None = None
    """Raises UserError when what is needed to write them is not installed."""
    package: str | None = None
    """Without which they are left out, with a warning."""
    reads_image: bool = False
    """Whether they are made of the image as a whole, so that they are left out, too, where that is too
    large."""

    @property
    def is_possible(self) -> bool:
        """Whether that package is there."""
        return self.package is None or is_installed(self.package)


def _write_map(map_: WrittenMap) -> None:
    save_map(map_.grid, map_.folder / "map.yaml", **_pixels(map_.rendering))


def _write_edits(map_: WrittenMap) -> None:
    if map_.edits.edits:
        save_edits(map_.edits, map_.folder)
    save_filter_masks(map_.grid, map_.edits.edits, map_.folder)


def _write_image(map_: WrittenMap) -> None:
    save_map_image(map_.grid, map_.folder / "map_image.png", **_pixels(map_.rendering))


def _pixels(rendering: RenderingConfig) -> dict[str, Any]:
    return {name: getattr(rendering, name) for name in ("mode", "occupied_threshold", "free_threshold")}


def _write_trajectory(map_: WrittenMap) -> None:
    if map_.trajectory is not None:
        save_tum(map_.trajectory, map_.folder / "trajectory.tum")


def _write_graph(map_: WrittenMap) -> None:
    constraints = list(map_.session.constraints_between_bases())
    save_g2o(map_.session.map_from_base, constraints, map_.folder / "pose_graph.g2o")


def _write_picture(map_: WrittenMap) -> None:
    from racecar.pipelines.files.pictures.map_picture import (
        MAP_DOTS_PER_INCH,
        MOST_DRAWN_CELLS,
        map_picture,
        save_figure,
    )

    keyframes, trajectory, starts = map_.session.map_from_base, map_.trajectory, np.zeros(0, dtype=np.int64)
    if trajectory is None:
        trajectory = Trajectory(np.arange(len(keyframes)), keyframes)
        starts = 1 + np.flatnonzero(np.diff(map_.session.drives))
    figure = map_picture(
        thinned(as_written(map_.grid, **_pixels(map_.rendering)), MOST_DRAWN_CELLS),
        trajectory,
        keyframes,
        list(map_.session.constraints_between_bases()),
        map_.title,
        map_.doubtful,
        starts=starts.tolist(),
        caution=map_.caution,
    )
    save_figure(map_.folder / "map.png", figure, MAP_DOTS_PER_INCH)


def _write_points(map_: WrittenMap) -> None:
    save_point_map(map_.session.points, map_.grid.resolution, map_.folder / "points.ply")


MAP_OUTPUTS = (
    MapOutputKind(("map.yaml", "map.pgm"), _write_map),
    MapOutputKind((), _write_edits),
    MapOutputKind(("trajectory.tum",), _write_trajectory),
    MapOutputKind(("pose_graph.g2o",), _write_graph),
    MapOutputKind(("map.png",), _write_picture, package="matplotlib"),
    MapOutputKind((SESSION_FILE,), lambda map_: save_session(map_.session, map_.folder / SESSION_FILE)),
    MapOutputKind(("points.ply",), _write_points, only_on_request=True, require=require_open3d),
    MapOutputKind(("map_image.png",), _write_image, only_on_request=True),
    MapOutputKind(
        ("walls.svg",),
        lambda map_: save_walls_svg(map_.walls, map_.grid.resolution, map_.folder / "walls.svg"),
        only_on_request=True,
        reads_image=True,
    ),
    MapOutputKind(
        ("walls.dxf",),
        lambda map_: save_walls_dxf(map_.walls, map_.folder / "walls.dxf"),
        only_on_request=True,
        require=lambda: require("ezdxf", "--dxf"),
        reads_image=True,
    ),
)
"""In the order in which they are written: the picture shows the map as its files hold it."""

MAP_FILES = (
    *(name for kind in MAP_OUTPUTS if not kind.only_on_request for name in kind.files),
    REPORT_FILE,
)
"""What every mapping run writes."""


def outputs_with(requested: Collection[str] = ()) -> list[MapOutputKind]:
    """The outputs of a run that is asked for some files too.

    Raises UserError when something is not installed that they need.
    """
    chosen = [kind for kind in MAP_OUTPUTS if not kind.only_on_request or kind.files[0] in requested]
    for kind in chosen:
        if kind.require is not None:
            kind.require()
    return chosen


def write_outputs(map_: WrittenMap, report: Report, requested: Collection[str] = ()) -> None:
    """Write what every run writes, and the files that are ``requested`` too, of a map with its edits; last
    the report. It warns of each edit that lies outside a map that is not cropped, and where the map is too
    large to be read again."""
    if map_.rendering.crop is None:
        for sentence in cautions_of_edits(map_.grid, map_.edits.edits):
            report.warn(sentence)
    for sentence in cautions_of_size(map_.grid):
        report.warn(sentence)
    with report.stage("writing"):
        map_ = replace(map_, grid=edited(map_.grid, map_.edits.edits))
        for output in outputs_with(requested):
            if not output.is_possible and output.package is not None:
                report.warn(left_out(f"{output.files[0]} was not drawn", output.package))
            elif not output.reads_image or map_.grid.size <= MOST_PIXELS:
                output.write(map_)
    report.write(map_.folder / REPORT_FILE)
