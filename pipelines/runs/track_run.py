"""The race track on the map of a run: the command ``racecar track``."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from racecar.mapping.config import MappingConfig
from racecar.maps.errors import UserError
from racecar.maps.grid.centre_line import CentreLine, centre_line
from racecar.maps.grid.edits import edited
from racecar.maps.grid.lap import CLOSING_DISTANCE, find_lap
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.whole_files import write_atomically
from racecar.pipelines.files.pictures.track_picture import save_track_picture
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.render_run import render_run
from racecar.pipelines.runs.run_context import RunContext

CELL = 0.02
"""Cell size in metres for measuring a track, whatever the map's, because coarse cells change the width of a
lane by their own size."""
_NARROW = 0.3
"""Metres between both edges below which a track causes a warning, since a small car is as wide."""
HEADER = "# x_m,y_m,w_tr_right_m,w_tr_left_m"
"""Columns defined by TUMFTM's global_racetrajectory_optimization, in which the first point follows the last
one."""


@dataclass(frozen=True, eq=False)
class MeasuredTrack:
    """A track, and the grid on which it was measured."""

    grid: OccupancyGrid
    line: CentreLine


def find_track(folder: Path, context: RunContext, *, spacing: float, smoothing: float) -> MeasuredTrack:
    """The track that the car of a mapping run drove; see `centre_line`. Warnings go into the report.

    Raises UserError when there is no closed lap, or most of it has no boundary.
    """
    report = context.report
    run = render_run(folder, MappingConfig(resolution=CELL), context)
    driven = run.trajectory.map_from_base if len(run.trajectory) else run.result.map_from_keyframe
    with report.stage("track"):
        lap = find_lap(driven)
        if lap is None:
            raise UserError(
                f"There is no closed lap in {folder}: the car never returns to a place in the direction in "
                f"which it left it, at most {CLOSING_DISTANCE:g} m beside it; drive on past where you "
                "began."
            )
        grid = edited(run.result.tiled, run.edits.edits).in_one_piece()
        line = centre_line(grid, lap, run.result.session.points, spacing=spacing, smoothing=smoothing)
    narrowest = int(np.argmin(line.widths))
    if (width := line.widths[narrowest]) < _NARROW:
        x, y = line.points[narrowest]
        report.warn(
            f"At ({x:.1f}, {y:.1f}) the track is only {width:.2f} m wide; if what stands there is gone, "
            "erase it in edits.yaml."
        )
    if not np.all(line.is_walled):
        x, y = line.points[np.argmin(line.is_walled)]
        report.warn(
            f"Along {np.mean(~line.is_walled):.0%} of the track a side is no wall (dotted in track.png), "
            f"first near ({x:.1f}, {y:.1f}): nothing was seen there, or the track crosses itself. Draw a "
            "wall in edits.yaml where there is one."
        )
    if len(crossed := line.crossed) > 0:
        x, y = line.points[crossed[0]]
        report.warn(
            f"Near ({x:.1f}, {y:.1f}) normals of the centre line cross, which optimizers refuse; smooth it "
            f"more, with --smoothing {1.5 * smoothing:.2g}."
        )
    return MeasuredTrack(grid, line)


def save_track(track: MeasuredTrack, report: Report, folder: Path, title: str) -> None:
    """Write ``track.csv`` and ``track.png`` into an existing folder."""
    line = track.line
    report.add(
        "track",
        {
            "length_m": line.length,
            "points": len(line.points),
            "narrowest_m": float(line.widths.min()),
            "widest_m": float(line.widths.max()),
            "walled_share": float(np.mean(line.is_walled)),
        },
    )
    with report.stage("writing"):
        save_track_csv(line, folder / "track.csv")
        save_track_picture(folder / "track.png", track.grid, line, title)


def save_track_csv(line: CentreLine, path: Path) -> None:
    """Write one line per point of the centre line. Raises UserError when the file cannot be written."""
    rows = np.column_stack([line.points, line.right.widths, line.left.widths])
    text = "".join(",".join(f"{value:.4f}" for value in row) + "\n" for row in rows)
    with write_atomically(path) as partial:
        partial.write_text(f"{HEADER}\n{text}", encoding="ascii")
