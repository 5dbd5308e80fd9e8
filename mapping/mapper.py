"""The mapper: one scan at a time, from odometry to an optimized map. The whole method is on this page."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.config import MappingConfig
from mapping.constraint import Constraint
from mapping.deskew import deskew, deskew_cloud
from mapping.keyframe_tracking import TIED_TO, constrain, place
from mapping.loop_closure import LoopCloser
from mapping.odometry_calibration import OdometryCalibration, calibrate
from mapping.pose_graph import PoseGraph
from mapping.refinement import refine_scans
from mapping.rendering import Rays, points_of, rays_of, render
from mapping.scan_odometry import ScanOdometry
from mapping.scan_store import ScanStore, prepare_scan
from maps.errors import UserError
from maps.occupancy_grid import OccupancyGrid
from maps.odometry import Odometry, OdometryBuffer
from maps.scan import Scan
from maps.se2 import IDENTITY, Pose, between, compose, inverse
from maps.trajectory import Trajectory

_WINDOW = 60
_WINDOW_HELD = 20
_WINDOW_EVERY = 5
_CALIBRATE_EVERY = 50
_CALIBRATE_OVER = 1000
_STALE_ODOMETRY = 500_000_000
_WORTH_OPTIMIZING = (0.15, 0.03)


@dataclass(frozen=True, eq=False)
class MappingResult:
    """What a mapping run yields."""

    trajectory: Trajectory
    """One pose of the base per scan."""
    grid: OccupancyGrid
    points: NDArray[np.float32]
    """(N, 2) metres in the map: the returns of all keyframes."""
    keyframe_indices: NDArray[np.int64]
    """(K,) scans that are keyframes."""
    constraints: list[Constraint]
    """Between the bases of keyframes."""
    seconds: dict[str, float]
    """Wall time by stage."""
    counts: dict[str, int]
    warnings: list[str]
    """Sentences for people."""


class Mapper:
    """Builds a map incrementally; scans and odometry come in the order of time."""

    def __init__(self, config: MappingConfig) -> None:
        self._config = config
        self._odometry = OdometryBuffer()
        self._scan_odometry = ScanOdometry()
        self._graph = PoseGraph()
        self._keyframes = ScanStore()
        self._loops = LoopCloser(self._keyframes, verify=config.verify_loops)
        self._calibration = OdometryCalibration()
        self._base_from_laser: Pose = IDENTITY
        self._rays: list[Rays] = []
        self._clouds: list[NDArray[np.float32]] = []
        self._stamps: list[int] = []
        self._keyframe_scans: list[int] = []
        self._after_keyframe: list[int] = []
        self._motions: list[Pose] = []
        self._keyframe_from_next: list[Pose] = []
        self._odometry_steps: list[Pose | None] = []
        self._map_from_keyframe: Pose = np.zeros((0, 3))
        self._last_odometry: Pose | None = None
        self._keyframe_odometry: Pose | None = None
        self._last_pose: Pose = IDENTITY
        self._last_motion: Pose = IDENTITY
        self._scans_without_odometry = 0
        self._keyframe_rate = np.zeros(3); self._keyframe_stamp=0
        self._keyframe_pose_in_odometry: Pose = IDENTITY
        self._seconds: dict[str, float] = {}

    def add_odometry(self, odometry: Odometry) -> None:
        """Take a sample of wheel odometry."""
        self._odometry.add(odometry)

    def add_scan(self, scan: Scan) -> Pose:
        """Take a scan; returns ``map_from_base`` (3,) as known now."""
        with self._timed("deskewing"):
            points, cloud = deskew(scan, self._odometry), deskew_cloud(scan, self._odometry)
        with self._timed("scan odometry"):
            odometry, motion = self._predict(scan)
            pose = self._scan_odometry.register(points if cloud is None else cloud, motion)
            self._last_motion, self._last_pose = between(self._last_pose, pose), pose
        if not self._stamps:
            self._start(scan)
        motions = self._motions_since_keyframe(scan.stamp, pose, odometry)
        if not self._keyframe_scans or self._is_far(motions[:-1]):
            self._add_keyframe(scan, points, motions, odometry)
            self._keyframe_pose_in_odometry = pose
            self._keyframe_rate = between(*self._map_from_keyframe[-2:])/(scan.stamp-self._keyframe_stamp) if len(self._map_from_keyframe)>1 else np.zeros(3)
            self._keyframe_stamp = scan.stamp
            motions = np.zeros((1, 3))
        self._stamps.append(scan.stamp)
        self._clouds.append(points.astype(np.float32))
        self._after_keyframe.append(len(self._keyframe_scans) - 1)
        self._motions.append(motions)
        map_from_laser = compose(self._map_from_keyframe[-1], motions[0])
        return compose(map_from_laser, inverse(self._base_from_laser))

    def finish(self, progress: Callable[[float], None] | None = None) -> MappingResult:
        """Settle the keyframes, refine every scan and render the grid. Raises UserError without any scan."""
        if not self._stamps:
            raise UserError(
                "There was no usable scan, so there is no map; `racecar check` tells what a bag holds."
            )
        report = progress or (lambda share: None)
        with self._timed("optimization"):
            self._settle()
        report(0.3)
        keyframe = np.array(self._after_keyframe)
        map_from_laser = self._scan_poses(keyframe)
        if self._config.refine:
            with self._timed("refinement"):
                map_from_laser = refine_scans(
                    self._clouds, keyframe, map_from_laser, self._keyframes, self._map_from_keyframe
                )
            map_from_laser[self._keyframe_scans] = self._map_from_keyframe
        report(0.8)
        with self._timed("rendering"):
            grid = render(self._rays, self._map_from_keyframe, self._config.resolution)
        report(1.0)
        map_from_base = compose(map_from_laser, inverse(self._base_from_laser))
        return MappingResult(
            trajectory=Trajectory(np.array(self._stamps, dtype=np.int64), map_from_base),
            grid=grid,
            points=points_of(self._rays, self._map_from_keyframe),
            keyframe_indices=np.array(self._keyframe_scans, dtype=np.int64),
            constraints=[self._between_bases(constraint) for constraint in self._graph.constraints],
            seconds=dict(self._seconds),
            counts=self._counts(),
            warnings=self._warnings(),
        )

    def _scan_poses(self, keyframe):
        motions = np.array([m[0] for m in self._motions])
        guesses = compose(self._map_from_keyframe[keyframe], motions)
        n = len(self._map_from_keyframe)
        if n==1: return guesses
        ends = compose(self._map_from_keyframe[:-1], np.array(self._keyframe_from_next))
        missed = np.concatenate([between(ends, self._map_from_keyframe[1:]), np.zeros((1, 3))])
        K = np.append(np.array(self._keyframe_scans),len(motions)+1)
        f = (np.arange(len(motions)) - K[keyframe]) / (K[keyframe+1]-K[keyframe])
        return compose(guesses, f[:,None]*missed[keyframe])

    def _start(self, scan: Scan) -> None:
        self._base_from_laser = scan.base_from_laser
        self._map_from_keyframe = np.array([scan.base_from_laser])

    def _predict(self, scan: Scan) -> tuple[Pose | None, Pose]:
        """Odometry's pose of the laser, if it has one, and the motion since the last scan."""
        latest = self._odometry.latest_stamp
        if latest is None or scan.stamp - latest > _STALE_ODOMETRY:
            self._scans_without_odometry += 1
            self._last_odometry = None
            return None, self._last_motion
        odometry = compose(self._odometry.pose_at(scan.stamp), scan.base_from_laser)
        last, self._last_odometry = self._last_odometry, odometry
        if last is None:
            return odometry, self._last_motion
        return odometry, self._calibration.correct(between(last, odometry))

    def _motions_since_keyframe(self, stamp, pose: Pose, odometry: Pose | None) -> Pose:
        """(H, 3) by the wheels, which are smoother over so short a way, if there are any; by the scans; and
        by going on as before."""
        by_scans = between(self._keyframe_pose_in_odometry, pose)
        steady = self._keyframe_rate*(stamp-self._keyframe_stamp)
        if odometry is None or self._keyframe_odometry is None:
            return np.array([by_scans, steady])
        by_wheels = self._calibration.correct(between(self._keyframe_odometry, odometry))
        return np.array([by_wheels, by_scans, steady])

    def _is_far(self, motions: Pose) -> bool:
        distances = np.hypot(motions[:, 0], motions[:, 1])
        return bool(
            np.any(distances >= self._config.keyframe_distance)
            or np.any(np.abs(motions[:, 2]) >= self._config.keyframe_angle)
        )

    def _add_keyframe(
        self, scan: Scan, points: NDArray[np.float64], motions: Pose, odometry: Pose | None
    ) -> None:
        index = self._keyframes.add(prepare_scan(points))
        self._keyframe_scans.append(len(self._stamps))
        self._rays.append(rays_of(scan, points))
        if index > 0:
            self._tie(index, motions, odometry)
        self._keyframe_odometry = odometry
        if index % _CALIBRATE_EVERY == 0:
            self._calibrate(max(0, index - _CALIBRATE_OVER))
        if index % _WINDOW_EVERY == 0 and index > _WINDOW_HELD:
            with self._timed("optimization"):
                first = max(0, index + 1 - _WINDOW)
                self._map_from_keyframe = self._graph.optimize_latest(
                    self._map_from_keyframe, first, _WINDOW_HELD
                )
        if self._config.close_loops:
            self._close_loops()

    def _tie(self, index: int, motions: Pose, odometry: Pose | None) -> None:
        """Place a new keyframe and connect it to those before."""
        with self._timed("scan matching"):
            guesses = compose(self._map_from_keyframe[-1], motions)
            worth = np.diag(self._calibration.information(IDENTITY))
            placed, chosen = place(index, guesses, worth, self._keyframes, self._map_from_keyframe)
            for k in range(self._keyframe_scans[-2], len(self._motions)):
                self._motions[k] = self._motions[k][chosen:chosen+1] if len(self._motions[k])>1 else self._motions[k]
            self._keyframe_from_next.append(motions[chosen])
            self._map_from_keyframe = np.concatenate([self._map_from_keyframe, placed[None]])
            pairs = np.array([(index - back, index) for back in TIED_TO if back <= index])
            constraints = constrain(pairs, self._map_from_keyframe, self._keyframes, widest=0.3)
        step = None
        if odometry is not None and self._keyframe_odometry is not None:
            step = between(self._keyframe_odometry, odometry)
            constraints.append(self._odometry_constraint(index, step))
        self._odometry_steps.append(step)
        for constraint in constraints:
            self._graph.add(constraint)

    def _odometry_constraint(self, index: int, step: Pose) -> Constraint:
        corrected = self._calibration.correct(step)
        matched = between(self._map_from_keyframe[index - 1], self._map_from_keyframe[index])
        information = self._calibration.information(between(corrected, matched))
        return Constraint(index - 1, index, corrected, information, "odometry")

    def _close_loops(self) -> None:
        steps = self._map_from_keyframe[-2:]
        distance = float(np.hypot(*(steps[-1, :2] - steps[0, :2])))
        if self._loops.add_keyframe(distance) is None:
            return
        with self._timed("loop closure"):
            closures = self._loops.close(self._map_from_keyframe)
        for closure in closures:
            self._graph.add(closure)
        if any(self._is_strained(closure) for closure in closures):
            with self._timed("optimization"):
                self._map_from_keyframe = self._graph.optimize(self._map_from_keyframe)

    def _is_strained(self, constraint: Constraint) -> bool:
        a, b = constraint.from_keyframe, constraint.to_keyframe
        measured = constraint.from_pose_to_pose
        error = between(measured, between(self._map_from_keyframe[a], self._map_from_keyframe[b]))
        distance, angle = _WORTH_OPTIMIZING
        return bool(np.hypot(error[0], error[1]) > distance or abs(error[2]) > angle)

    def _calibrate(self, first: int) -> None:
        """Learn the wheels' errors from the keyframe steps from ``first`` on."""
        known = [i for i, step in enumerate(self._odometry_steps) if step is not None and i >= first]
        measured = np.array([self._odometry_steps[i] for i in known]).reshape(-1, 3)
        matched = between(self._map_from_keyframe[:-1], self._map_from_keyframe[1:])
        self._calibration = calibrate(measured, matched[known])

    def _settle(self) -> None:
        """Match all pairs of keyframes once more from where they are now, and solve the whole graph."""
        if len(self._keyframes) == 1:
            return
        self._map_from_keyframe = self._graph.optimize(self._map_from_keyframe)
        self._calibrate(0)
        graph = PoseGraph()
        count = len(self._keyframes)
        pairs = np.array([(i - back, i) for i in range(count) for back in TIED_TO if back <= i])
        for constraint in constrain(pairs, self._map_from_keyframe, self._keyframes, widest=0.3):
            graph.add(constraint)
        for i, step in enumerate(self._odometry_steps):
            if step is not None:
                graph.add(self._odometry_constraint(i + 1, step))
        for constraint in self._graph.constraints:
            if constraint.kind == "loop_closure":
                graph.add(constraint)
        self._graph = graph
        self._map_from_keyframe = graph.optimize(self._map_from_keyframe)

    def _between_bases(self, constraint: Constraint) -> Constraint:
        """The same constraint between the bases instead of the lasers."""
        base, laser = self._base_from_laser, inverse(self._base_from_laser)
        moved = compose(compose(base, constraint.from_pose_to_pose), laser)
        adjoint = _adjoint(laser)
        information = adjoint.T @ constraint.information @ adjoint
        return Constraint(
            constraint.from_keyframe, constraint.to_keyframe, moved, information, constraint.kind
        )

    def _counts(self) -> dict[str, int]:
        kinds = [constraint.kind for constraint in self._graph.constraints]
        return {
            "scans": len(self._stamps),
            "keyframes": len(self._keyframes),
            "scan_matching_constraints": kinds.count("scan_matching"),
            "odometry_constraints": kinds.count("odometry"),
            "loop_closures": kinds.count("loop_closure"),
            "scans_without_odometry": self._scans_without_odometry,
            **{f"loops_{name}": count for name, count in self._loops.log.items()},
        }

    def _warnings(self) -> list[str]:
        warnings = []
        if self._scans_without_odometry == len(self._stamps):
            warnings.append(
                "There was no wheel odometry: lengths of bare corridors are not to be trusted, "
                "and fast turns may have been lost."
            )
        return warnings

    @contextmanager
    def _timed(self, stage: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            self._seconds[stage] = self._seconds.get(stage, 0.0) + time.perf_counter() - start


def _adjoint(pose: Pose) -> NDArray[np.float64]:
    """(3, 3) of SE(2): carries a twist from the frame of b to that of a, for a_from_b."""
    x, y, yaw = pose
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.array([[cos, -sin, y], [sin, cos, -x], [0.0, 0.0, 1.0]])
