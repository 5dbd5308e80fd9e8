"""Maps of several drives become one: what ``racecar merge`` does."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.judgement import judge
from racecar.mapping.quality.map_quality import MapQuality
from racecar.mapping.session.drawing import DrawnMap, Views, draw_map
from racecar.mapping.session.merging import EarlierMap, merge
from racecar.mapping.session.session import Session
from racecar.mapping.session.unrecognized import NotRecognizedError
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, compose, inverse
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.edits_file import MapEdits, edits_beside, edits_together
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.session_file import load_session
from racecar.pipelines.runs.map_outputs import WrittenMap, write_outputs
from racecar.pipelines.runs.place_finding import LocalizerSearch
from racecar.pipelines.runs.source_recording import SourceRecording


@dataclass(eq=False)
class MergedRun:
    """What became of the runs in some folders; all of it lies in the frame of the longest."""

    session: Session
    first_keyframes: dict[Path, int]
    """Of each run that was joined, where its keyframes begin."""
    frames: dict[Path, Pose] = field(default_factory=dict)
    """(3,) of each of them: the frame it had, seen from that of all."""
    left_out: dict[Path, str] = field(default_factory=dict)
    """Why each of the others was not joined, in a sentence without a full stop."""


@dataclass(frozen=True, eq=False)
class MergedMap:
    """The map of a merged run."""

    run: MergedRun
    drawn: DrawnMap
    quality: MapQuality
    edits: MapEdits


def merge_runs(folders: Sequence[Path], config: Config, seed: int, report: Report) -> MergedRun:
    """Join the sessions in folders, the longest first, so that their order does not matter.

    What fits nowhere yet is tried again after another one was joined. What fits nowhere at all is left out,
    as is a drive that is in the map already, and the report warns of that. Raises UserError when a session
    cannot be read, and when none was joined.
    """
    with report.stage("reading"):
        sessions = {folder: load_session(folder) for folder in folders}
    waiting = sorted(sessions, key=lambda folder: _size(sessions[folder]), reverse=True)
    longest = waiting.pop(0)
    run = MergedRun(sessions[longest], {longest: 0})
    run.left_out, waiting = _without_repeated(longest, waiting)
    with report.stage("merging"):
        before = 0
        while waiting and len(waiting) != before:
            before = len(waiting)
            waiting = [each for each in waiting if not _join(run, each, sessions[each], config, seed)]
    for folder, why in run.left_out.items():
        report.warn(f"{folder} was left out: {why}.")
    if len(run.first_keyframes) == 1:
        why = next(iter(run.left_out.values()))
        raise UserError(f"None of the maps could be joined to {longest}, the longest: {why}.")
    for folder, first in run.first_keyframes.items():
        alone = sessions[folder].map_from_keyframe[0]
        run.frames[folder] = compose(run.session.map_from_keyframe[first], inverse(alone))
    return run


def draw_merged(run: MergedRun, config: Config, report: Report) -> MergedMap:
    """Draw and judge the map of runs that were joined, with the edits of all of them."""
    mapping, session = config.mapping, run.session
    unknown = np.full(len(session.rays), np.nan)
    with report.stage("rendering"):
        drawn = draw_map(
            *(Views.of(session), session.keyframes, mapping.resolution, mapping.rendering), keep_frame=True
        )
    for sentence in drawn.disregarded:
        report.warn(sentence)
    with report.stage("judging"):
        quality = judge(FinishedMap(session, unknown), mapping.quality)
    edits = edits_together([edits_beside(folder).moved(frame) for folder, frame in run.frames.items()])
    return MergedMap(run, drawn, quality, edits)


def save_merged(
    merged: MergedMap, config: Config, report: Report, folder: Path, *, requested: Collection[str]
) -> None:
    """Write every file of a merged map into an existing folder."""
    run, grid = merged.run, merged.drawn.tiled
    names = ("x_m", "y_m", "yaw_rad")
    frames = {str(source): dict(zip(names, pose, strict=True)) for source, pose in run.frames.items()}
    report.add("inputs", {"settings": config.mapping.model_dump()})
    report.add("counts", {"keyframes": len(run.session.rays), "sessions": len(run.frames)})
    report.add(
        "result",
        {
            "map_metres": list(grid.metres),
            "frames_of_sources": frames,
            "left_out": {str(source): why for source, why in run.left_out.items()},
        },
    )
    report.add("quality", merged.quality.as_dict())
    written = WrittenMap(
        session=run.session,
        grid=grid,
        rendering=config.mapping.rendering,
        trajectory=None,
        doubtful=merged.quality.segments,
        caution=merged.quality.caution,
        edits=merged.edits,
        title=" + ".join(source.absolute().name for source in run.frames),
        folder=folder,
    )
    write_outputs(written, report, requested)


def _without_repeated(longest: Path, others: Sequence[Path]) -> tuple[dict[Path, str], list[Path]]:
    """Why some of the ``others`` are left out, whose drive another map shows; and what remains."""
    kept = {longest: SourceRecording.of_run(longest)}
    left_out: dict[Path, str] = {}
    for folder in others:
        own = SourceRecording.of_run(folder)
        same = next((each for each, recording in kept.items() if own.is_within(recording)), None)
        if same is not None and own.is_all:
            left_out[folder] = f"it is of the same recording as {same}, which would count twice"
        else:
            kept[folder] = own
    return left_out, [folder for folder in kept if folder != longest]


def _size(session: Session) -> tuple[float, bytes]:
    """Metres driven; then, among equals, what they lie like, so that the order is always the same."""
    path = session.loops.graph.path
    return (path[-1] if len(path) else 0.0), session.map_from_keyframe.tobytes()


def _join(run: MergedRun, folder: Path, session: Session, config: Config, seed: int) -> bool:
    """Join a session to those before; whether it was recognized there."""
    search = LocalizerSearch(run.session, config.mapping, config.localization, seed, None)
    earlier, first = run.session, len(run.session.rays)
    try:
        run.session = merge(EarlierMap(earlier, search), session)
    except NotRecognizedError as error:
        run.left_out[folder] = _as_clause(str(error))
        return False
    run.session.drives = _alongside(earlier.drives, session.drives)
    run.left_out.pop(folder, None)
    run.first_keyframes[folder] = first
    return True


def _alongside(one: NDArray[np.int32], other: NDArray[np.int32]) -> NDArray[np.int32]:
    """(K + L,) the drives (K,) and (L,) of two maps of which neither is known to be newer: their last drives
    count as of the same time."""
    last = max(one.max(), other.max())
    return np.concatenate([one + last - one.max(), other + last - other.max()])


def _as_clause(sentence: str) -> str:
    return sentence[:1].lower() + sentence[1:]
