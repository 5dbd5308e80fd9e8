"""A map rendered again from its session: what ``racecar render`` does."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.config import MappingConfig
from racecar.mapping.grid.log_odds import looks_until_free
from racecar.mapping.quality.map_quality import Verdict
from racecar.mapping.session.drawing import DrawnMap, Views, draw_map
from racecar.mapping.session.session import Session
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, compose
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.edits_file import MapEdits
from racecar.pipelines.files.keyframe_times import seconds_of_keyframes
from racecar.pipelines.files.outputs import output_folder
from racecar.pipelines.files.report import REPORT_FILE, Report
from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.files.session_file import load_session
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.runs.edited_folders import refuse_to_lose_edits
from racecar.pipelines.runs.map_outputs import WrittenMap, outputs_with, write_outputs

_CARRIED_OVER: dict[str, bool | set[str]] = {
    "inputs": True,
    "counts": True,
    "result": True,
    "quality": {"verdict", "error_per_10_m", "error_of_whole_m"},
}
"""What of a mapping run's report holds of the same map rendered again, because it says what it was made of
and what it is worth; but for sentences that name places in the frame it had."""


@dataclass(frozen=True, eq=False)
class RenderedRun:
    """A run that is rendered again; all of it lies in the frame of its grid."""

    session: Session
    trajectory: Trajectory | None
    """None where the run has none."""
    drawn: DrawnMap
    edits: MapEdits


def render_into(
    out: Path,
    run: Path,
    config: MappingConfig,
    edits: MapEdits,
    report: Report,
    *,
    edits_from: Path,
    requested: Collection[str] = (),
) -> None:
    """Render a ``run`` with edits in its frame into the folder ``out``, which may be its own: all files that
    every run has, and those ``requested``.

    Raises UserError as `render_run`, when ``out`` cannot be written to, and when it holds edits of people
    other than those, which are in the file or folder ``edits_from``.
    """
    with output_folder(out) as folder:
        outputs_with(requested)  # what is missing for them is reported at once
        rendered = render_run(run, config, edits, report)
        refuse_to_lose_edits(out, rendered.edits, edits_from)
        save_rendering(rendered, run, config, report, folder, requested=requested)


def render_run(folder: Path, config: MappingConfig, edits: MapEdits, report: Report) -> RenderedRun:
    """Render what a mapping run left in a folder, with ``edits`` in its frame; warnings go into the report.

    Raises UserError when there is nothing to be read, and when settings leave nothing to be drawn.
    """
    with report.stage("reading"):
        session = load_session(folder)
        trajectory, seconds = _times(folder, session, report)
    if config.rendering.left_out and np.isnan(seconds).all():
        raise UserError(
            f"The times of the scans in {folder} are not known, so none can be left out: its trajectory.tum "
            "is missing or of another map."
        )
    with report.stage("rendering"):
        views = Views.of(session, seconds)
        drawn = draw_map(views, session.keyframes, config.resolution, config.rendering)
    if drawn.disregarded:
        raise UserError(drawn.disregarded[0])
    if len(session.rays) < looks_until_free(config.rendering):
        report.warn(
            f"The map was made of {len(session.rays)} keyframes, too few to show free floor: map its bag "
            "again, which uses the scans between them, too."
        )
    if (move := drawn.drawn_from_map) is not None:
        session = session.moved(move)
        if trajectory is not None:
            trajectory = replace(trajectory, map_from_base=compose(move, trajectory.map_from_base))
    return RenderedRun(session, trajectory, drawn, edits.moved(move))


def save_rendering(
    run: RenderedRun,
    source: Path,
    config: MappingConfig,
    report: Report,
    folder: Path,
    *,
    requested: Collection[str],
) -> None:
    """Write every file of a run that was rendered again from a ``source`` into an existing folder."""
    grid = run.drawn.tiled
    move = IDENTITY if run.drawn.drawn_from_map is None else run.drawn.drawn_from_map
    earlier = read_report(source)
    if earlier.damage:
        report.warn(earlier.damage)
    for section, values in earlier.model_dump(
        include=_CARRIED_OVER, by_alias=True, exclude_unset=True
    ).items():
        report.add(section, values)
    report.add(
        "inputs", {"rendered_from": source, "settings": config.model_dump(), "edits": len(run.edits.edits)}
    )
    report.add(
        "result",
        {
            "map_metres": list(grid.metres),
            "frame_of_source": dict(zip(("x_m", "y_m", "yaw_rad"), move, strict=True)),
        },
    )
    written = WrittenMap(
        session=run.session,
        grid=grid,
        rendering=config.rendering,
        trajectory=run.trajectory,
        doubtful=(),
        caution=_caution(source, earlier.quality.verdict),
        edits=run.edits,
        title=source.absolute().name,
        folder=folder,
    )
    write_outputs(written, report, requested)


def _times(folder: Path, session: Session, report: Report) -> tuple[Trajectory | None, NDArray[np.float64]]:
    """The trajectory in a folder, if it is of the session there, and the times (K,) of the keyframes in
    seconds since it began, NaN where they are not known."""
    unknown = np.full(len(session.rays), np.nan)
    path = folder / "trajectory.tum"
    if not path.is_file():
        report.warn(
            f"{folder} holds no trajectory.tum, so that none is written, and the path that is drawn is the "
            "keyframes'."
        )
        return None, unknown
    trajectory = load_tum(path)
    seconds = seconds_of_keyframes(session.map_from_base[:, :2], trajectory)
    if np.isnan(seconds).all():
        report.warn(f"{path} is not of the session beside it, so it was not used.")
        return None, unknown
    return trajectory, seconds


def _caution(source: Path, verdict: str | None) -> str:
    """Where to read why the map that was rendered is not good."""
    if verdict not in (Verdict.DOUBTFUL.value, Verdict.WRONG.value):
        return ""
    return f"The map is {verdict}: {REPORT_FILE} of {source.absolute().name} says why and where."
