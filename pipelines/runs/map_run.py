"""A map and everything known about it: the result of mapping, rendering, merging and live drives."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from os.path import realpath
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from racecar.mapping.grid.rendering import pixels_of
from racecar.mapping.mapper import Mapper
from racecar.mapping.quality.map_quality import MapQuality
from racecar.mapping.session.merging import EarlierMap
from racecar.mapping.session.session import Session
from racecar.mapping.state.result import MappingResult
from racecar.maps.calls import checked
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, between
from racecar.maps.grid.edits import edited
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.maps.map_files import MOST_PIXELS, as_written
from racecar.maps.text_files import read_text
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.edits_file import EDITS_FILE, MapEdits, is_made_by_us
from racecar.pipelines.files.optional_packages import left_out
from racecar.pipelines.files.outputs import output_folder
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.run_html import run_html
from racecar.pipelines.files.run_report import REPORT_FILE
from racecar.pipelines.runs.corrected_session import CorrectedSession
from racecar.pipelines.runs.floor_plan_run import plan_under
from racecar.pipelines.runs.map_cautions import cautions_of_edits, cautions_of_size
from racecar.pipelines.runs.map_outputs import MAP_NAMES, outputs_with, remove_outdated
from racecar.pipelines.runs.output_places import OutputFolder, check_saving
from racecar.pipelines.runs.run_context import RunContext

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OPTIMIZING = "Optimizing"
"""Progress after the reading, when a request to stop no longer has an effect."""


NO_TRAJECTORY = Trajectory(np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
"""The trajectory of a map whose scan times are unknown."""


@dataclass(frozen=True, eq=False)
class MapRun:
    """The map of a bag or of several drives, the path driven, and the quality of both; in one frame."""

    result: MappingResult
    """The mapper's full result, with the constraints between keyframes."""
    report: Report
    """The contents of report.json."""
    title: str
    """The bag's name, or another description of the map."""
    edits: MapEdits = MapEdits()  # noqa: RUF009 (frozen)
    """Edits drawn over the map when it is written."""
    source: Path | None = None
    """The folder of the map that this one extends or renders again, or the file with its edits; None for a
    new map."""
    floor_plan: OccupancyGrid | None = None
    """The floor plan under the map, if one was laid there."""

    @property
    def grid(self) -> OccupancyGrid:
        """The map: ``cells`` (rows, columns) in percent occupied, -1 unknown, row 0 at the lowest y;
        ``resolution`` in metres per cell; ``map_from_grid`` (3,), the outer corner of cell (0, 0)."""
        return self.result.grid

    @property
    def written_grid(self) -> OccupancyGrid:
        """The map as its files hold it: with the edits, each cell occupied, free or unknown."""
        return as_written(self._edited, **pixels_of(self.result.rendering)).in_one_piece()

    @property
    def _edited(self) -> TiledGrid:
        return edited(self.result.tiled, self.edits.edits)

    @property
    def trajectory(self) -> Trajectory:
        """The car at each scan: ``stamps`` (N,) in nanoseconds, ``map_from_base`` (N, 3) in metres, metres
        and radians."""
        return self.result.trajectory

    @property
    def session(self) -> Session:
        """What a later drive needs to extend the map; it remembers the manual constraints among the edits."""
        session = self.result.session
        if session.measured is None:
            return session
        return replace(session, measured=replace(session.measured, mended_by=self.edits.constraints_text))

    @property
    def quality(self) -> MapQuality:
        """The verdict (good, doubtful or wrong), the expected error, and the reasons."""
        return self.result.quality

    @property
    def warnings(self) -> list[str]:
        """Faults of the bag and doubts about the map, one sentence each."""
        return self.report.warnings

    def __repr__(self) -> str:
        return f"<MapRun of {self.title}, {len(self.trajectory)} scans. {self.quality.summary}>"

    def _repr_html_(self) -> str:
        return run_html(self.title, self.quality.summary, self._edited, self.trajectory, len(self.warnings))

    @checked
    def plot(self) -> "Figure":
        """The map with the path and the loops closed, as in map.png.

        A notebook shows the figure by itself, a script with ``matplotlib.pyplot.show()``.
        """
        from racecar.pipelines.files.pictures.figure_files import figure_to_show
        from racecar.pipelines.runs.map_drawing import picture_of

        return picture_of(self, figure_to_show)

    @checked
    def save(self, folder: str | Path, requested: Collection[str] = (), *, replace: bool = False) -> None:
        """Write the files that ``racecar map`` writes, such as map.yaml, map.png and trajectory.tum, and
        those ``requested``, such as walls.svg.

        The folder is created; other files in it stay. Raises UserError when it cannot be written to, when it
        holds edits that would be lost, and, unless told to ``replace`` them, when it holds other results than
        those that this map was made from.
        """
        folder = Path(folder)
        remade = () if self.source is None else (self.source,)
        check_saving(OutputFolder(folder, lambda: (*MAP_NAMES, *requested), remade), replace=replace)
        with output_folder(folder) as staging:
            protect_edits(folder, self.edits, self.source, self.report)
            self.write(staging, requested, replaced=folder)

    def write(self, folder: Path, requested: Collection[str] = (), replaced: Path | None = None) -> None:
        """Write the same into an existing folder, the report last. It warns of each edit outside a map that
        is not cropped, of a map that is too large to be read back, and of files in the folder of a
        ``replaced`` run that show its map and go with it."""
        result, report = self.result, self.report
        outside = cautions_of_edits(result.tiled, self.edits.edits) if result.rendering.crop is None else []
        for sentence in [*outside, *cautions_of_size(result.tiled)]:
            report.warn(sentence)
        with report.stage("writing"):
            drawn = replace(self, result=replace(result, tiled=self._edited))
            for output in outputs_with(requested):
                if not output.is_possible and output.package is not None:
                    report.warn(left_out(f"{output.files[0]} was not drawn", output.package))
                elif not output.reads_image or result.tiled.size <= MOST_PIXELS:
                    output.write(drawn, folder)
            if replaced is not None:
                remove_outdated(replaced, folder, report)
        report.write(folder / REPORT_FILE)


def finish_map(
    mapper: Mapper,
    context: RunContext,
    title: str,
    earlier: EarlierMap | None = None,
    told: Collection[str] = (),
) -> MapRun:
    """Finish the map of a drive, possibly extending an ``earlier`` one; figures and warnings go into the
    report, except for warnings already ``told``.

    Raises UserError when there is no map, and NotRecognizedError when the drive is not recognized on the
    earlier one.
    """
    report = context.report
    with report.stage("optimizing"), context.progress(OPTIMIZING) as advance_to:
        result = mapper.finish(advance_to, earlier, title)
    report.add("counts", result.counts)
    report.add("result", _described(result))
    report.add("mapping_seconds", result.seconds)
    report.add("consistency", _residuals(result))
    report.add("quality", result.quality.as_dict())
    for sentence in result.warnings:
        if sentence not in told:
            report.warn(sentence)
    return MapRun(result, report, title)


def extending(run: MapRun, known: CorrectedSession) -> MapRun:
    """The run of a drive that extends a ``known`` map, with the edits on that and the floor plan under it.
    Raises UserError when these cannot be read."""
    edits = known.edits.in_recordings_from(0)
    plan = plan_under(known.folder, edits)
    return replace(run, edits=edits, source=known.folder, floor_plan=plan)


def frame_figures(frame: Pose) -> dict[str, float]:
    """A frame (3,) of a source, for the report."""
    return dict(zip(("x_m", "y_m", "yaw_rad"), frame, strict=True))


def protect_edits(out: Path, edits: MapEdits, source: Path | None, report: Report) -> None:
    """Make sure that edits in a folder are neither lost nor drawn in another frame.

    Edits of a new map (without a ``source``) stay there but are not drawn, since its frame may differ from
    that of the map it replaces; the report warns of that. Raises UserError when edits written by hand would
    be replaced by those of the source.
    """
    path = out / EDITS_FILE
    if not path.is_file():
        return
    if source is None:
        report.warn(
            f"{path} was not applied, and no mask drawn, because a new map may lie in another frame; if it "
            f"fits, `racecar render {out} --out {out}` does both."
        )
        return
    home, there = source if source.is_dir() else source.parent, read_text(path)
    if realpath(out) != realpath(home) and there != edits.text and not is_made_by_us(there):
        raise UserError(
            f"{path} holds other edits than those of {source}: move them there, or render {out} itself, "
            "or remove the file."
        )


def _described(result: MappingResult) -> dict[str, object]:
    places = result.trajectory.map_from_base[result.keyframe_indices, :2]  # the scans between them jitter
    seconds = (result.trajectory.stamps[-1] - result.trajectory.stamps[0]) * 1e-9
    return {
        "log_seconds": seconds,
        "path_metres": np.sum(np.hypot(*np.diff(places, axis=0).T)),
        "map_metres": list(result.tiled.metres),
    }


def _residuals(result: MappingResult) -> dict[str, dict[str, float]]:
    """For each kind of constraint: how many there are, and the mean residual of the solution."""
    keyframes = result.map_from_keyframe
    by_kind: dict[str, list[np.ndarray]] = {}
    for constraint in result.constraints:
        solved = between(keyframes[constraint.from_keyframe], keyframes[constraint.to_keyframe])
        by_kind.setdefault(constraint.kind, []).append(between(constraint.from_pose_to_pose, solved))
    summary = {}
    for kind, residuals in by_kind.items():
        dx, dy, turn = np.array(residuals).T
        summary[kind] = {
            "constraints": len(residuals),
            "mean_residual_m": float(np.mean(np.hypot(dx, dy))),
            "mean_residual_deg": float(np.mean(np.abs(np.rad2deg(turn)))),
        }
    return summary
