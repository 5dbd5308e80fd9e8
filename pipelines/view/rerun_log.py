"""A scene as a rerun recording, and how it is laid out at first."""

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.view.rerun_style import CAR, CAR_LENGTH, LOOP, PARTICLE, PATH, SCAN, SKY, raised
from racecar.pipelines.view.scene import Scene

_TIME = "drive"
_FREE, _OCCUPIED, _UNKNOWN = np.array([[255, 255, 255], [27, 31, 36], [223, 227, 232]])
_HEIGHTS = {"path": 0.05, "keyframes": 0.08, "loops": 0.1, "car": 0.12, "scan": 0.15, "particles": 0.2}
"""Metres above the map, so that everything is seen from above."""
_CAR_DOT = "car/place"
"""It is seen from afar; from near it would cover the particles."""
_FIELD_OF_VIEW, _ASPECT = np.radians(48.0), 1.35
"""Of the view at its first look: the angle from bottom to top, and its width over its height."""
_MARGIN = 1.1
_NEAR_HEIGHT = 3.5
"""Metres from which the car is seen from near."""


def save_recording(scene: Scene, path: Path) -> None:
    """Write a scene as an ``.rrd`` file."""
    stream = rr.RecordingStream("racecar", recording_id=scene.title)
    stream.save(path, default_blueprint=blueprint(scene))
    _log(scene, stream)
    stream.flush()
    stream.disconnect()


def blueprint(scene: Scene) -> rrb.Blueprint:
    """The whole map from above; beside it the car from near, words, and how sure the pose was."""
    beside: list[rrb.View] = [
        _view(
            "Near the car, its heading up",
            "map/car",
            ["+ map/**", f"- map/{_CAR_DOT}"],
            _looking_down([0.0, 0.0], _NEAR_HEIGHT, up=[1.0, 0.0, 0.0]),
        ),
        rrb.TextDocumentView(origin="about", name="About this run"),
    ]
    if np.any(scene.deviations):
        beside += [
            rrb.TimeSeriesView(origin="deviation/place", name="Standard deviation of the place (cm)"),
            rrb.TimeSeriesView(origin="deviation/heading", name="Standard deviation of the heading (°)"),
        ]
    return rrb.Blueprint(
        rrb.Horizontal(
            _view(scene.title, "map", ["+ map/**"], _from_above(scene)),
            rrb.Vertical(*beside, row_shares=[4, 2, 2, 2][: len(beside)]),
            column_shares=[5, 2],
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=_TIME, play_state="playing", loop_mode="all"),
        auto_views=False,
    )


def _view(name: str, origin: str, contents: list[str], eye: rrb.EyeControls3D) -> rrb.Spatial3DView:
    """What is in the map as seen from a frame; of the path only what the car has driven so far."""
    so_far = rrb.VisibleTimeRanges(
        timeline=_TIME,
        start=rrb.TimeRangeBoundary.infinite(),
        end=rrb.TimeRangeBoundary.cursor_relative(seconds=0.0),
    )
    return rrb.Spatial3DView(
        origin=origin,
        name=name,
        contents=contents,
        background=[255, 255, 255],
        line_grid=False,
        eye_controls=eye,
        overrides={"map/driven": so_far},
    )


def _log(scene: Scene, stream: rr.RecordingStream) -> None:
    stream.log("about", rr.TextDocument(scene.about, media_type=rr.MediaType.MARKDOWN), static=True)
    if scene.grid is not None:
        stream.log("map/grid", as_grid_map(scene.grid), static=True)
    path = raised(scene.trajectory.map_from_base[:, :2], _HEIGHTS["path"])
    stream.log("map/path", rr.LineStrips3D([path], colors=SKY, radii=-1.5), static=True)
    if len(scene.keyframes):
        places = raised(scene.keyframes, _HEIGHTS["keyframes"])
        stream.log("map/keyframes", rr.Points3D(places, colors=CAR, radii=-2.5), static=True)
    if len(scene.loops):
        ends = [raised(pair, _HEIGHTS["loops"]) for pair in scene.loops]
        stream.log("map/loop_closures", rr.LineStrips3D(ends, colors=LOOP, radii=-2.0), static=True)
    _log_drive(scene, stream)


def _log_drive(scene: Scene, stream: rr.RecordingStream) -> None:
    """All that changes with time."""
    trajectory = scene.trajectory
    start = int(trajectory.stamps[0])
    height = _HEIGHTS["car"]
    arrow = rr.Arrows3D(vectors=[[CAR_LENGTH, 0, 0]], origins=[[0, 0, height]], colors=CAR, radii=0.03)
    stream.log("map/car", arrow, static=True)
    stream.log(f"map/{_CAR_DOT}", rr.Points3D([[0, 0, height]], colors=CAR, radii=-5.0), static=True)
    seconds = rr.TimeColumn(_TIME, duration=(trajectory.stamps - start) * 1e-9)
    stream.send_columns(
        "map/car",
        [seconds],
        rr.Transform3D.columns(
            translation=np.column_stack([trajectory.map_from_base[:, :2], np.zeros(len(trajectory))]),
            quaternion=_quaternions(trajectory.map_from_base[:, 2]),
        ),
    )
    places = raised(trajectory.map_from_base[:, :2], _HEIGHTS["path"])
    stream.log("map/driven", rr.Points3D.from_fields(colors=[PATH], radii=[-1.5]), static=True)
    stream.send_columns("map/driven", [seconds], rr.Points3D.columns(positions=places))
    if len(scene.deviations):
        place, heading = scene.deviations.T
        stream.send_columns("deviation/place", [seconds], rr.Scalars.columns(scalars=100 * place))
        stream.send_columns("deviation/heading", [seconds], rr.Scalars.columns(scalars=np.degrees(heading)))
    for sight in scene.sights:
        stream.set_time(_TIME, duration=(sight.stamp - start) * 1e-9)
        points = raised(sight.points_in_base, _HEIGHTS["scan"])
        stream.log("map/car/scan", rr.Points3D(points, colors=SCAN, radii=-2.0))
    for cloud in scene.clouds:
        stream.set_time(_TIME, duration=(cloud.stamp - start) * 1e-9)
        points = raised(cloud.map_from_base[:, :2], _HEIGHTS["particles"])
        stream.log("map/particles", rr.Points3D(points, colors=PARTICLE, radii=-2.0))


def as_grid_map(grid: OccupancyGrid) -> rr.GridMap:
    """A grid as rerun shows one, free cells white and walls dark."""
    rows, columns = grid.cells.shape
    x, y, yaw = grid.map_from_grid
    share = np.clip(grid.cells, 0, 100)[..., None] / 100.0
    colors = np.where((grid.cells >= 0)[..., None], _FREE + share * (_OCCUPIED - _FREE), _UNKNOWN)
    return rr.GridMap(
        data=colors[::-1].astype(np.uint8).tobytes(),
        format=rr.components.ImageFormat(
            width=columns, height=rows, color_model="RGB", channel_datatype="U8"
        ),
        cell_size=grid.resolution,
        translation=[x, y, 0.0],
        quaternion=rr.Quaternion(xyzw=_quaternions(np.array([yaw]))[0]),
    )


def _from_above(scene: Scene) -> rrb.EyeControls3D:
    """High enough to see the whole drive, x to the right."""
    low, high = _extent(scene)
    width, depth = high - low
    x, y = (low + high) / 2
    height = _MARGIN * max(width / _ASPECT, depth) / (2 * np.tan(_FIELD_OF_VIEW / 2)) + 1.0
    return _looking_down([x, y], height, up=[0.0, 1.0, 0.0])


def _looking_down(place: list[float], height: float, up: list[float]) -> rrb.EyeControls3D:
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital, position=[*place, height], look_target=[*place, 0.0], eye_up=up
    )


def _extent(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower left and upper right (2,) of the path and of what is known of the map."""
    places = scene.trajectory.map_from_base[:, :2]
    if scene.grid is not None:
        places = np.vstack([places, scene.grid.center_of(np.argwhere(scene.grid.cells >= 0))])
    return places.min(axis=0), places.max(axis=0)


def _quaternions(yaw: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 4) as x, y, z, w."""
    zeros = np.zeros(len(yaw))
    return np.column_stack([zeros, zeros, np.sin(yaw / 2), np.cos(yaw / 2)])
