"""The files of a mapping run. A new one is a module that writes it, and an entry of this list."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from filecmp import cmp
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.grid.rendering import pixels_of
from racecar.maps.map_files import load_map, save_map, save_map_image
from racecar.maps.whole_folders import remove_with
from racecar.pipelines.files.edits_file import save_edits
from racecar.pipelines.files.filter_masks import FILTERS, filter_files, save_filter_masks
from racecar.pipelines.files.floor_plan_grid import FLOOR_PLAN_FILES, save_floor_plan
from racecar.pipelines.files.g2o import save_g2o
from racecar.pipelines.files.optional_packages import is_installed, require
from racecar.pipelines.files.point_map import save_point_map
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.run_report import REPORT_FILE
from racecar.pipelines.files.session_file import SESSION_FILE, save_session
from racecar.pipelines.files.tum import save_tum
from racecar.pipelines.files.wall_drawings import save_walls_dxf, save_walls_svg

if TYPE_CHECKING:
    from racecar.pipelines.runs.map_run import MapRun


POINTS_FILE = "points.ply"


@dataclass(frozen=True)
class MapOutputKind:
    """One kind of output, of one or more files."""

    files: tuple[str, ...]
    """Names of the files that every map has."""
    write: "Callable[[MapRun, Path], None]"
    """Write them into a folder; the grid includes its edits. Raises UserError when that is impossible."""
    only_on_request: bool = False
    """Whether they are written only when their first file is requested."""
    require: Callable[[], object] | None = None
    """Raises UserError when a required package is not installed."""
    package: str | None = None
    """Without this package they are skipped, with a warning."""
    reads_image: bool = False
    """Whether they need the whole image, so that they are also skipped if it is too large."""

    @property
    def is_possible(self) -> bool:
        """Whether that package is installed."""
        return self.package is None or is_installed(self.package)


def _write_map(run: "MapRun", folder: Path) -> None:
    save_map(run.result.tiled, folder / "map.yaml", **pixels_of(run.result.rendering))


def _write_edits(run: "MapRun", folder: Path) -> None:
    if run.edits.entries:
        save_edits(run.edits, folder)
    save_filter_masks(run.result.tiled, run.edits.edits, folder)


def _write_image(run: "MapRun", folder: Path) -> None:
    save_map_image(run.result.tiled, folder / "map_image.png", **pixels_of(run.result.rendering))


def _write_trajectory(run: "MapRun", folder: Path) -> None:
    path = folder / "trajectory.tum"
    if len(run.trajectory):
        save_tum(run.trajectory, path)
    else:
        remove_with(path)


def _write_picture(run: "MapRun", folder: Path) -> None:
    from racecar.pipelines.files.pictures.figure_files import MAP_DOTS_PER_INCH, save_figure
    from racecar.pipelines.runs.map_drawing import picture_of

    save_figure(folder / "map.png", picture_of(run), MAP_DOTS_PER_INCH)


def _write_points(run: "MapRun", folder: Path) -> None:
    if run.result.clouds is None:
        run.report.warn(
            f"{POINTS_FILE} lies in the plane z = 0: the heights that a 3D LiDAR saw are in the bag alone, "
            "for `racecar map --ply`."
        )
    elif run.result.clouds and run.source is not None:
        run.report.warn(f"{POINTS_FILE} shows the new drive alone: heights of earlier ones are not kept.")
    save_point_map(run.result.points_in_space(), run.result.tiled.resolution, folder / POINTS_FILE)


def _write_svg(run: "MapRun", folder: Path) -> None:
    save_walls_svg(_walls(folder), run.result.tiled.resolution, folder / "walls.svg")


def _walls(folder: Path) -> list[NDArray[np.float64]]:
    """Polylines (N, 2) in metres, from the map as its files hold it."""
    from racecar.maps.grid.wall_lines import wall_lines  # rarely needed, and slow to load

    return wall_lines(load_map(folder))


MAP_OUTPUTS = (
    MapOutputKind(("map.yaml", "map.pgm"), _write_map),
    MapOutputKind((), _write_edits),
    MapOutputKind((), lambda run, folder: save_floor_plan(run.floor_plan, folder)),
    MapOutputKind(("trajectory.tum",), _write_trajectory),
    MapOutputKind(
        ("pose_graph.g2o",),
        lambda run, folder: save_g2o(
            run.result.map_from_keyframe, run.result.constraints, folder / "pose_graph.g2o"
        ),
    ),
    MapOutputKind(("map.png",), _write_picture, package="matplotlib"),
    MapOutputKind((SESSION_FILE,), lambda run, folder: save_session(run.session, folder / SESSION_FILE)),
    MapOutputKind(
        (POINTS_FILE,), _write_points, only_on_request=True, require=lambda: require("open3d", "--ply")
    ),
    MapOutputKind(("map_image.png",), _write_image, only_on_request=True),
    MapOutputKind(("walls.svg",), _write_svg, only_on_request=True, reads_image=True),
    MapOutputKind(
        ("walls.dxf",),
        lambda run, folder: save_walls_dxf(_walls(folder), folder / "walls.dxf"),
        only_on_request=True,
        require=lambda: require("ezdxf", "--dxf"),
        reads_image=True,
    ),
)
"""In the order of writing: the picture shows the map as its files hold it."""

_MAP = ("map.yaml", "map.pgm")
DERIVED = {
    POINTS_FILE: ("--ply, with heights only from the bag,", (SESSION_FILE,)),
    "map_image.png": ("--png", _MAP),
    "walls.svg": ("--svg", _MAP),
    "walls.dxf": ("--dxf", _MAP),
    "track.csv": ("racecar track", _MAP),
    "track.png": ("racecar track", _MAP),
}
"""Files that are not made with every map: what makes them, and the files that they show."""

MAP_FILES = (
    *(name for kind in MAP_OUTPUTS if not kind.only_on_request for name in kind.files),
    REPORT_FILE,
)
"""The files that every mapping run writes."""

MAP_NAMES = (
    *MAP_FILES,
    *DERIVED,
    *FLOOR_PLAN_FILES,
    *(name for kind in FILTERS for name in filter_files(kind)),
)
"""The files that a mapping run may replace or remove: what shows an earlier map, an earlier plan, and the
masks of earlier edits, too."""


def outputs_with(requested: Collection[str] = ()) -> list[MapOutputKind]:
    """The outputs of a run, including the requested files.

    Raises UserError when a package that they need is not installed.
    """
    chosen = [kind for kind in MAP_OUTPUTS if not kind.only_on_request or kind.files[0] in requested]
    for kind in chosen:
        if kind.require is not None:
            kind.require()
    return chosen


def remove_outdated(replaced: Path, new: Path, report: Report) -> None:
    """Remove, with the map in a folder that a ``new`` one replaces, what shows it and is not made again. The
    report names each."""
    for name, (how, shown) in DERIVED.items():
        if not (replaced / name).is_file() or (new / name).exists():
            continue
        if not all(_is_same(replaced / each, new / each) for each in shown):
            remove_with(new / name)
            report.warn(f"{replaced / name} showed the earlier map and was removed; {how} makes it again.")


def _is_same(one: Path, other: Path) -> bool:
    return one.is_file() and other.is_file() and cmp(one, other, shallow=False)
