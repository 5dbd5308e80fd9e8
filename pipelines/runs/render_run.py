"""Render a map again from its session: the command ``racecar render``, and other work on the map of a run."""

from pathlib import Path

from racecar.mapping.config import MappingConfig
from racecar.mapping.grid.log_odds import looks_until_free
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.judgement import judge
from racecar.mapping.quality.map_quality import MapQuality, Verdict
from racecar.mapping.session.drawing import Views, draw_map
from racecar.mapping.session.session import Session
from racecar.mapping.state.result import MappingResult
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.edits_file import edits_beside, load_edits
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.run_report import REPORT_FILE, Quality, read_report
from racecar.pipelines.files.session_file import load_session
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.runs.corrected_session import load_corrected
from racecar.pipelines.runs.floor_plan_run import PlanRequest, lay_plan, plan_under
from racecar.pipelines.runs.map_run import NO_TRAJECTORY, MapRun, frame_figures
from racecar.pipelines.runs.run_context import RunContext

_CARRIED_OVER: dict[str, bool | set[str]] = {
    "inputs": True,
    "counts": True,
    "result": True,
    "quality": {"verdict", "error_per_10_m", "error_of_whole_m"},
}
"""Parts of a mapping run's report that remain true when its map is rendered again: its inputs and its
quality, but not sentences that name places in its old frame."""


def render_run(
    source: Path,
    config: MappingConfig,
    context: RunContext,
    edits_file: Path | None = None,
    plan: PlanRequest | None = None,
) -> MapRun:
    """Render the map of a run in the folder ``source`` again from its session, in its frame or that of a
    floor plan, with the edits beside it or from another file; figures and warnings go into the report.

    Raises UserError when there is nothing to read, or when the settings leave nothing to draw.
    """
    report = context.report
    with report.stage("reading"):
        edits = edits_beside(source) if edits_file is None else load_edits(edits_file)
        floor_plan = plan_under(source, edits)
        if plan is not None:
            laid = lay_plan(plan, load_session(source), config.resolution, context)
            edits, floor_plan = laid.held(edits), laid.grid
        corrected = load_corrected(source, context, edits)
        session, edits, bent = corrected.session, corrected.edits, corrected.deformation
        trajectory = _trajectory(source, session if bent is None else bent.before, report)
        if bent is not None:
            trajectory = bent.trajectory(trajectory)
    with report.stage("rendering"):
        drawn = draw_map(Views.of(session), session.keyframes, config.resolution, config.rendering)
    if drawn.disregarded:
        raise UserError(drawn.disregarded[0])
    if len(session.rays) < looks_until_free(config.rendering):
        report.warn(
            f"The map was made of {len(session.rays)} keyframes, too few to show free floor: map its bag "
            "again, which uses the scans between them, too."
        )
    if (move := drawn.drawn_from_map) is not None:
        session, trajectory = session.moved(move), trajectory.moved(move)
        floor_plan = None if floor_plan is None else floor_plan.moved(move)
    edits = edits.moved(move)
    earlier = read_report(source)
    if earlier.damage:
        report.warn(earlier.damage)
    carried_over = earlier.model_dump(include=_CARRIED_OVER, by_alias=True, exclude_unset=True)
    for section, values in carried_over.items():
        report.add(section, values)
    report.add(
        "inputs", {"rendered_from": source, "settings": config.model_dump(), "edits": len(edits.entries)}
    )
    frame = frame_figures(IDENTITY if move is None else move)
    report.add("result", {"map_metres": list(drawn.tiled.metres), "frame_of_source": frame})
    title = source.absolute().name
    quality = _known_quality(earlier.quality, title) if bent is None else None
    if quality is None:
        quality = judge(FinishedMap(session), config.quality)
        report.add("quality", quality.as_dict())
    result = MappingResult(session, drawn.tiled, config.rendering, trajectory, quality)
    return MapRun(result, report, title, edits, source=edits_file or source, floor_plan=floor_plan)


def _trajectory(folder: Path, session: Session, report: Report) -> Trajectory:
    """The trajectory in a folder, if it belongs to the session there; else an empty one, and a warning."""
    path = folder / "trajectory.tum"
    if not path.is_file():
        report.warn(
            f"{folder} holds no trajectory.tum, so that none is written, and the path that is drawn is the "
            "keyframes'."
        )
        return NO_TRAJECTORY
    trajectory = load_tum(path)
    if not session.is_of(trajectory):
        report.warn(f"{path} is not of the session beside it, so it was not used.")
        return NO_TRAJECTORY
    return trajectory


def _known_quality(told: Quality, source: str) -> MapQuality | None:
    """The quality from the run's report, without places in its old frame."""
    if told.error_per_10_m is None or told.error_of_whole_m is None:
        return None
    try:
        verdict = Verdict(told.verdict)
    except ValueError:
        return None
    reasons = () if verdict == Verdict.GOOD else (f"{REPORT_FILE} of {source} says why and where.",)
    return MapQuality(verdict, told.error_per_10_m, told.error_of_whole_m, reasons, (), {})
