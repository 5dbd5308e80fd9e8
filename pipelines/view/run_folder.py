"""A run's folder as something to look at: its recording where there is one, else its files."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.arrays import Arrays
from racecar.mapping.graph.constraint import KINDS
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import between, compose, inverse, transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.maps.whole_folders import finish_replacing
from racecar.pipelines.files.keyframe_times import SAME_PLACE, scans_of_keyframes
from racecar.pipelines.files.literal_markdown import literal
from racecar.pipelines.files.report import named_map, read_report
from racecar.pipelines.files.session_file import SESSION_FILE, load_arrays
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.view.record_file import read_record
from racecar.pipelines.view.recorder import RECORD_FOLDER
from racecar.pipelines.view.scene import Doubt, Scene, Sight

_SCAN_MATCHING, _LOOP_CLOSURE = KINDS.index("scan_matching"), KINDS.index("loop_closure")


def load_run(folder: Path) -> Scene:
    """What a mapping or localization run left in a folder. Raises UserError when it left nothing."""
    finish_replacing(folder)
    report = read_report(folder)
    scene = _recorded_or_driven(folder, folder.absolute().name, _about(report))
    if scene.grid is None:
        scene.grid = _find_grid(folder, report)
    if (folder / SESSION_FILE).is_file():
        _add_session(scene, load_arrays(folder / SESSION_FILE, "racecar session"))
    scene.doubts = _doubts_of(report)
    return scene


def _recorded_or_driven(folder: Path, title: str, about: str) -> Scene:
    """The recording; without one, or with one that an earlier run left, the trajectory alone."""
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


def _are_same(driven: Trajectory, recorded: Trajectory) -> bool:
    return np.array_equal(driven.stamps, recorded.stamps) and np.allclose(
        driven.map_from_base[:, :2], recorded.map_from_base[:, :2], atol=SAME_PLACE
    )


def _find_grid(folder: Path, report: dict[str, Any]) -> OccupancyGrid | None:
    """The map in the folder, or the one that its report names, if it is still there."""
    return load_map(folder) if (folder / "map.yaml").is_file() else named_map(report)


def _add_session(scene: Scene, arrays: Arrays) -> None:
    """Keyframes and loop closures; where no scans were recorded, those of the keyframes."""
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
    if not scene.sights:
        scene.sights = _sights_of_keyframes(arrays, places, scene.trajectory)


def _sights_of_keyframes(arrays: Arrays, places: NDArray[np.float64], trajectory: Trajectory) -> list[Sight]:
    """The keyframes' scans; a keyframe's time is that of the scan whose pose it has.

    Keyframes of earlier drives have no time in this one and are left out.
    """
    scans, are_known = scans_of_keyframes(places, trajectory)
    ends = np.cumsum(arrays["scans.counts"].astype(np.int64))
    points = np.split(arrays["scans.points"], ends[:-1])
    base_from_laser = inverse(arrays["keyframe_from_base"])
    return [
        Sight(
            int(trajectory.stamps[scan]),
            transform_points(pose, seen.astype(np.float64)).astype(np.float32),
        )
        for scan, is_known, pose, seen in zip(scans, are_known, base_from_laser, points, strict=True)
        if is_known
    ]


def _doubts_of(report: dict[str, Any]) -> list[Doubt]:
    """What the verdict names, of a map or of a localization."""
    segments = report.get("quality", {}).get("segments", [])
    return [_doubt_of(segment) for segment in segments if {"x_m", "y_m"} <= segment.keys()]


def _doubt_of(segment: dict[str, Any]) -> Doubt:
    begin, end = segment.get("from_s"), segment.get("to_s")
    seconds = None if begin is None or end is None else (float(begin), float(end))
    why = segment.get("why") or f"The car's place was {'lost' if segment.get('lost') else 'not known'}."
    return Doubt(why, np.array([segment["x_m"], segment["y_m"]], dtype=np.float64), seconds)


def _about(report: dict[str, Any]) -> str:
    """What a person wants to know first, as Markdown."""
    lines = [f"## {literal(str(report.get('command', 'A run')))}"]
    inputs, counts, result = (report.get(section, {}) for section in ("inputs", "counts", "result"))
    for label, value in (
        ("bag", inputs.get("bag")),
        ("map", inputs.get("map")),
        ("scans", counts.get("scans")),
        ("path", _metres(result.get("path_metres") or counts.get("path_metres"))),
        ("verdict", report.get("quality", {}).get("verdict")),
        ("end points on walls", _share(report.get("accuracy", {}))),
    ):
        if value is not None:
            lines.append(f"- {label}: {literal(str(value))}")
    lines += [f"\n**Warning:** {literal(str(sentence))}" for sentence in report.get("warnings", [])]
    return "\n".join(lines)


def _metres(value: float | None) -> str | None:
    return None if value is None else f"{value:.1f} m"


def _share(accuracy: dict[str, Any]) -> str | None:
    value = accuracy.get("share_of_end_points_within_0.10_m_of_a_wall")
    return None if value is None else f"{value:.0%}"
