"""The picture of a map: map.png, and `MapRun.plot`."""

from typing import TYPE_CHECKING

from racecar.mapping.grid.rendering import pixels_of
from racecar.maps.grid.thinning import thinned
from racecar.maps.map_files import as_written
from racecar.pipelines.files.pictures.figure_files import NewFigure, figure_for_file
from racecar.pipelines.files.pictures.grid_drawing import MOST_DRAWN_CELLS
from racecar.pipelines.files.pictures.map_picture import Line, map_picture
from racecar.pipelines.runs.run_headings import heading

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from racecar.pipelines.runs.map_run import MapRun


def picture_of(run: "MapRun", new_figure: NewFigure = figure_for_file) -> "Figure":
    """The map as its files hold it, with the path of each drive."""
    result, drives = run.result, _drives(run)
    keyframes = result.map_from_keyframe[:, :2]
    width, height = result.tiled.metres
    facts = (f"cells of {100 * result.tiled.resolution:g} cm", f"{width:.0f} × {height:.0f} m")
    path_metres = float(result.session.path[-1])
    return map_picture(
        thinned(as_written(result.tiled, **pixels_of(result.rendering)), MOST_DRAWN_CELLS),
        drives,
        heading(run.title, run.quality, path_metres, result.session.times.recordings, facts),
        loops=[
            keyframes[[each.from_keyframe, each.to_keyframe]]
            for each in result.constraints
            if each.kind == "loop_closure"
        ],
        doubtful=[
            keyframes[first : last + 1]
            for each in run.quality.segments
            for first, last in filter(None, (each.keyframes, each.contradicted_by))
        ],
        floor_plan=run.floor_plan,
        new_figure=new_figure,
    )


def _drives(run: "MapRun") -> list[Line]:
    """The path of each recording by its keyframes; that of the last one by all its scans, if known."""
    keyframes, times = run.result.map_from_keyframe[:, :2], run.result.session.times
    drives = [keyframes[times.numbers == number] for number in range(len(times.recordings))]
    if len(run.trajectory):
        drives[-1] = run.trajectory.map_from_base[:, :2]
    return [drive for drive in drives if len(drive)]
