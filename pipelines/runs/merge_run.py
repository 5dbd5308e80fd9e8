"""Merge maps of several drives into one: the command ``racecar merge``."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.judgement import judge
from racecar.mapping.session.drawing import Views, draw_map
from racecar.mapping.session.merging import EarlierMap, merge
from racecar.mapping.session.session import Session, has_recording_of
from racecar.mapping.session.unrecognized import NotRecognizedError
from racecar.mapping.state.result import MappingResult
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, compose, inverse
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.edits_file import MapEdits, edits_together
from racecar.pipelines.runs.corrected_session import CorrectedSession, load_corrected
from racecar.pipelines.runs.error_sentences import TO_BE_RECOGNIZED
from racecar.pipelines.runs.map_run import NO_TRAJECTORY, MapRun, frame_figures
from racecar.pipelines.runs.run_context import RunContext


def merge_runs(folders: Sequence[Path], config: Config, context: RunContext) -> MapRun:
    """The map of all sessions in folders, with the edits beside them, in the frame of the longest; figures
    and warnings go into the report.

    A session that fits nowhere or is already in the map is left out, with a warning in the report. Raises
    UserError when a session cannot be read, and when none was joined to the longest.
    """
    report, mapping = context.report, config.mapping
    report.add("inputs", {"settings": mapping.model_dump()})
    with report.stage("reading"):
        corrected = {folder: load_corrected(folder, context) for folder in folders}
        sessions = {folder: each.session for folder, each in corrected.items()}
    with report.stage("merging"):
        joined = _joined(sessions)
        session, frames, left_out = joined.session, joined.frames, joined.left_out
    for folder, why in left_out.items():
        report.warn(f"{folder} was left out: {why}.")
    remedy = TO_BE_RECOGNIZED if joined.unrecognized else ""
    if len(frames) == 1:
        reasons = (f"{folder}: {why}" for folder, why in left_out.items())
        told = "; ".join(filter(None, [*reasons, remedy]))
        raise UserError(f"None of the maps could be joined to {next(iter(frames))}. {told}.")
    if remedy:
        report.warn(f"To join a drive that was not recognized: {remedy}.")
    with report.stage("rendering"):
        views = Views.of(session)
        drawn = draw_map(views, session.keyframes, mapping.resolution, mapping.rendering, keep_frame=True)
    for sentence in drawn.disregarded:
        report.warn(sentence)
    with report.stage("judging"):
        quality = judge(FinishedMap(session), mapping.quality)
    report.add("counts", {"keyframes": len(session.rays), "sessions": len(frames)})
    report.add(
        "result",
        {
            "map_metres": list(drawn.tiled.metres),
            "frames_of_sources": {str(folder): frame_figures(pose) for folder, pose in frames.items()},
            "left_out": {str(folder): why for folder, why in left_out.items()},
        },
    )
    report.add("quality", quality.as_dict())
    return MapRun(
        MappingResult(session, drawn.tiled, mapping.rendering, NO_TRAJECTORY, quality),
        report,
        title=" + ".join(folder.absolute().name for folder in frames),
        edits=_edits_of(corrected, frames),
        source=folders[0],
    )


def _edits_of(corrected: dict[Path, CorrectedSession], frames: dict[Path, Pose]) -> MapEdits:
    """The edits of all joined maps, in the common frame."""
    parts, recordings = [], 0
    for folder, frame in frames.items():
        parts.append(corrected[folder].edits.moved(frame).in_recordings_from(recordings))
        recordings += len(corrected[folder].session.times.recordings)
    return edits_together(parts)


@dataclass(frozen=True, eq=False)
class _Joined:
    """Sessions that were joined to a first one."""

    session: Session
    frames: dict[Path, Pose]
    """Old frame (3,) of each joined session relative to the common one."""
    unrecognized: dict[Path, str]
    """The reason for each of the others, in a sentence without a full stop."""
    repeated: dict[Path, str] = field(default_factory=dict)
    """The same for those that are of a recording in it."""

    @property
    def left_out(self) -> dict[Path, str]:
        """All that are not in it."""
        return {**self.repeated, **self.unrecognized}


def _joined(sessions: dict[Path, Session]) -> _Joined:
    """One session of all that fit together. Each may be the first, the longest before the others, so that the
    order of the arguments does not matter; the first one that most others fit is taken."""
    by_length = sorted(sessions, key=lambda folder: _size(sessions[folder]), reverse=True)
    repeated = _repeated(by_length, sessions)
    kept = [folder for folder in by_length if folder not in repeated]
    best: _Joined | None = None
    for first in kept:
        found = _joined_to(first, {folder: sessions[folder] for folder in kept})
        if best is None or len(found.frames) > len(best.frames):
            best = found
        if not found.unrecognized:
            break
    assert best is not None
    return replace(best, repeated=repeated)


def _joined_to(first: Path, sessions: dict[Path, Session]) -> _Joined:
    """Those that fit a first one, or what was joined to it before."""
    merged, first_keyframes = sessions[first], {first: 0}
    waiting, unrecognized = [folder for folder in sessions if folder != first], dict[Path, str]()
    before = 0
    while waiting and len(waiting) != before:
        before = len(waiting)
        for folder in list(waiting):
            earlier = merged
            try:
                merged = merge(EarlierMap(earlier), sessions[folder], is_newer=False)
            except NotRecognizedError as error:
                unrecognized[folder] = _as_clause(str(error))
                continue
            unrecognized.pop(folder, None)
            waiting.remove(folder)
            first_keyframes[folder] = len(earlier.rays)
    frames = {
        folder: compose(merged.map_from_keyframe[number], inverse(sessions[folder].map_from_keyframe[0]))
        for folder, number in first_keyframes.items()
    }
    return _Joined(merged, frames, unrecognized)


def _repeated(folders: Sequence[Path], sessions: dict[Path, Session]) -> dict[Path, str]:
    """Which of the folders hold a recording that an earlier one holds, and that sentence."""
    kept: list[Path] = []
    repeated: dict[Path, str] = {}
    for folder in folders:
        same = next((each for each in kept if has_recording_of(sessions[each], sessions[folder])), None)
        if same is None:
            kept.append(folder)
        else:
            repeated[folder] = f"it is of the same recording as {same}, which would count twice"
            if len(sessions[folder].times.recordings) > 1:
                repeated[folder] += "; merge the maps of its other recordings instead"
    return repeated


def _size(session: Session) -> tuple[float, bytes]:
    """Metres driven; ties are broken by their shape, so that the order is always the same."""
    path = session.loops.graph.path
    return (path[-1] if len(path) else 0.0), session.map_from_keyframe.tobytes()


def _as_clause(sentence: str) -> str:
    return sentence[:1].lower() + sentence[1:]
