"""Load a run's folder for display: its recording if there is one, or else its files."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import KINDS
from racecar.mapping.session.session import SAME_PLACE
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import between, compose, inverse, transform_points
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.maps.whole_folders import finish_replacing
from racecar.pipelines.files.floor_plan_grid import floor_plan_beside
from racecar.pipelines.files.literal_markdown import literal
from racecar.pipelines.files.run_report import RunReport, Segment, read_report
from racecar.pipelines.files.session_file import SESSION_FILE, load_session_arrays
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.runs.view.record_file import read_record
from racecar.pipelines.runs.view.recorder import RECORD_FOLDER
from racecar.pipelines.runs.view.scene import Doubt, Scene, Sight
from racecar.sensors.arrays import Arrays

_SCAN_MATCHING, _LOOP_CLOSURE = KINDS.index("scan_matching"), KINDS.index("loop_closure")


def load_run(folder: Path) -> Scene:
    """Load the output of a mapping or localization run; unreadable parts are reported beside the rest.

    Raises UserError when it has neither a trajectory nor a readable recording.
    """
    finish_replacing(folder)
    report = read_report(folder)
    scene = _recorded_or_driven(folder, folder.absolute().name, _about(report))
    for add in (_add_grid, _add_floor_plan, _add_session):
        try:
            add(scene, folder, report)
        except UserError as error:
            scene.about += _warning(str(error))
    quality = report.quality
    scene.doubts = _doubts_of(quality.segments)
    scene.verdict, scene.reasons = quality.verdict or "", quality.reasons
    scene.expected = expected_words(quality.error_per_10_m, quality.error_of_whole_m)
    return scene


def _recorded_or_driven(folder: Path, title: str, about: str) -> Scene:
    """The recording; if there is none, or only one of an earlier run, the trajectory alone."""
    path = folder / "trajectory.tum"
    driven = load_tum(path) if path.is_file() else None
    if (folder / RECORD_FOLDER).is_dir():
        scene = read_record(folder / RECORD_FOLDER, title, about)
        if driven is None or _are_same(driven, scene.trajectory):
            return scene
        about += "\n\nThe recording in this folder is of an earlier run, so it is ignored."
    if driven is None:
        raise UserError(
            f"{folder} holds no run: there is no trajectory.tum; name a folder that `racecar map` or "
            "`racecar localize` has written."
        )
    return Scene(title, about, driven)


def expected_words(near: float | None, whole: float | None) -> str:
    """The expected errors, in metres per 10 m of path and over the whole, for people."""
    words = [] if near is None else [f"{100 * near:.1f} cm per 10 m"]
    words += [] if whole is None else [f"{100 * whole:.0f} cm over the whole"]
    return f"expect errors of {', '.join(words)}" if words else ""


def _are_same(driven: Trajectory, recorded: Trajectory) -> bool:
    return np.array_equal(driven.stamps, recorded.stamps) and np.allclose(
        driven.map_from_base[:, :2], recorded.map_from_base[:, :2], atol=SAME_PLACE
    )


def _add_grid(scene: Scene, folder: Path, report: RunReport) -> None:
    """Unless one was recorded, add the map in the folder, or the one that its report names, if it still
    exists."""
    if scene.grid is None:
        scene.grid = load_map(folder) if (folder / "map.yaml").is_file() else report.named_map()


def _add_floor_plan(scene: Scene, folder: Path, _: RunReport) -> None:
    scene.floor_plan = floor_plan_beside(folder)


def _add_session(scene: Scene, folder: Path, _: RunReport) -> None:
    """Add keyframes and loop closures, and the keyframes' scans if no scans were recorded."""
    if not (folder / SESSION_FILE).is_file():
        return
    arrays = load_session_arrays(folder)
    map_from_laser = arrays["map_from_keyframe"]
    map_from_base = compose(map_from_laser, arrays["keyframe_from_base"])
    places: NDArray[np.float64] = map_from_base[:, :2]
    ties, kinds = arrays["constraints.keyframes"], arrays["constraints.kinds"]
    is_match = kinds == _SCAN_MATCHING
    first, second = ties[is_match].T
    solved = between(map_from_laser[first], map_from_laser[second])
    missed = between(arrays["constraints.poses"][is_match], solved)
    scene.keyframes = places
    scene.loops = places[ties[kinds == _LOOP_CLOSURE]]
    scene.matches, scene.misses = places[ties[is_match]], np.hypot(missed[:, 0], missed[:, 1])
    stamps = np.where(_are_of_last(arrays), arrays["times.stamps"], 0)
    scene.match_stamps = np.where(stamps[first] > 0, stamps[second], 0)
    if not scene.sights:
        scene.sights = _sights_of_keyframes(arrays)


def _sights_of_keyframes(arrays: Arrays) -> list[Sight]:
    """The keyframes' scans in the last recording."""
    ends = np.cumsum(arrays["scans.counts"].astype(np.int64))
    points = np.split(arrays["scans.points"], ends[:-1])
    base_from_laser = inverse(arrays["keyframe_from_base"])
    return [
        Sight(
            stamp,
            transform_points(pose, seen.astype(np.float64)).astype(np.float32),
        )
        for stamp, is_of_last, pose, seen in zip(
            arrays["times.stamps"].tolist(), _are_of_last(arrays), base_from_laser, points, strict=True
        )
        if is_of_last
    ]


def _are_of_last(arrays: Arrays) -> NDArray[np.bool_]:
    """(K,) whether a keyframe is of the last recording."""
    are: NDArray[np.bool_] = arrays["times.recordings"] == len(arrays["times.names"]) - 1
    return are


def _doubts_of(segments: Iterable[Segment]) -> list[Doubt]:
    """Segments named by the verdict on a map or a localization."""
    return [
        _doubt_of(segment, np.array([segment.x_m, segment.y_m]))
        for segment in segments
        if segment.x_m is not None and segment.y_m is not None
    ]


def _doubt_of(segment: Segment, place: NDArray[np.float64]) -> Doubt:
    begin, end = segment.from_s, segment.to_s
    seconds = None if begin is None or end is None else (begin, end)
    why = segment.why or f"The car's place was {'lost' if segment.lost else 'not known'}."
    return Doubt(why, place, seconds)


def _about(report: RunReport) -> str:
    """A summary for people, as Markdown."""
    path_metres, share = (
        report.result.path_metres or report.counts.path_metres,
        report.accuracy.share_on_walls,
    )
    lines = [f"## {literal(report.command)}"]
    for label, value in (
        ("bag", report.inputs.bag),
        ("map", report.inputs.map),
        ("scans", report.counts.scans),
        ("path", None if path_metres is None else f"{path_metres:.1f} m"),
        ("verdict", report.quality.verdict),
        ("end points on walls", None if share is None else f"{share:.0%}"),
    ):
        if value is not None:
            lines.append(f"- {label}: {literal(str(value))}")
    return "\n".join(lines) + "".join(map(_warning, report.cautions))


def _warning(sentence: str) -> str:
    return f"\n\n**Warning:** {literal(sentence)}"
