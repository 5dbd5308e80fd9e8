"""The files that a mapping run writes: a new one is a module that writes it, and an entry of this list."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from racecar.mapping.state.result import MappingResult
from racecar.maps.map_files import load_map, save_map
from racecar.pipelines.files.g2o import save_g2o
from racecar.pipelines.files.point_map import require_open3d, save_point_map
from racecar.pipelines.files.report import REPORT_FILE
from racecar.pipelines.files.session_file import SESSION_FILE, save_session
from racecar.pipelines.files.tum import save_tum
from racecar.pipelines.pictures.map_picture import save_map_picture


@dataclass(frozen=True)
class WrittenMap:
    """What is written, and where to."""

    result: MappingResult
    folder: Path
    title: str


@dataclass(frozen=True)
class MapOutputKind:
    """Some files of a mapping run."""

    files: tuple[str, ...]
    """Their names."""
    write: Callable[[WrittenMap], None]
    """Write them. Raises UserError when the place cannot be written to."""
    only_on_request: bool = False
    """Whether they are written only when their first file is asked for."""
    require: Callable[[], object] | None = None
    """Raises UserError when what is needed to write them is not installed."""


def _write_picture(map_: WrittenMap) -> None:
    result = map_.result
    save_map_picture(
        map_.folder / "map.png",
        load_map(map_.folder),  # as whoever reads the files sees it
        result.trajectory,
        result.map_from_keyframe,
        result.constraints,
        map_.title,
        result.quality.segments,
    )


MAP_OUTPUTS = (
    MapOutputKind(("map.yaml", "map.pgm"), lambda map_: save_map(map_.result.grid, map_.folder / "map.yaml")),
    MapOutputKind(
        ("trajectory.tum",), lambda map_: save_tum(map_.result.trajectory, map_.folder / "trajectory.tum")
    ),
    MapOutputKind(
        ("pose_graph.g2o",),
        lambda map_: save_g2o(
            map_.result.map_from_keyframe, map_.result.constraints, map_.folder / "pose_graph.g2o"
        ),
    ),
    MapOutputKind(("map.png",), _write_picture),
    MapOutputKind(
        (SESSION_FILE,), lambda map_: save_session(map_.result.session, map_.folder / SESSION_FILE)
    ),
    MapOutputKind(
        ("points.ply",),
        lambda map_: save_point_map(
            map_.result.points, map_.result.grid.resolution, map_.folder / "points.ply"
        ),
        only_on_request=True,
        require=require_open3d,
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
