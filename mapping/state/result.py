"""The result of a mapping run."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.map_quality import MapQuality
from racecar.mapping.session.drawing import DrawnMap, Views
from racecar.mapping.session.session import Session
from racecar.mapping.state.mapper_state import MapperState
from racecar.maps.geometry.se2 import Pose, compose, transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.maps.trajectory import Trajectory
from racecar.sensors.motion.lag import NOTICEABLE, lag_finding

WITHOUT_WHEELS = (
    "No wheel odometry was used: lengths of bare corridors are not to be trusted, and fast turns may have "
    "been lost."
)
"""Warning if no scan had wheel odometry; whoever read the recording may already have said so, and why."""


@dataclass(frozen=True, eq=False)
class MappingResult:
    """A map: the result of a mapping run, and what is made of its session later."""

    session: Session
    """The session, for later drives to extend the map."""
    tiled: TiledGrid
    rendering: RenderingConfig
    """How the grid was drawn, and is to be written."""
    trajectory: Trajectory
    """One pose of the base per scan; none at all where they are not known any more."""
    quality: MapQuality
    keyframe_indices: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """(L,) indices of scans that are keyframes: the last L of all keyframes."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall time by stage."""
    counts: dict[str, int] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    """Sentences for people."""
    clouds: dict[int, NDArray[np.float32]] | None = None
    """(N, 3) deskewed points by keyframe of this drive, metres in the levelled laser frame; not for planar or
    trimmed ones. None if not requested."""

    @cached_property
    def grid(self) -> OccupancyGrid:
        """The grid as one array. Raises UserError when it is too large."""
        return self.tiled.in_one_piece()

    @cached_property
    def map_from_keyframe(self) -> Pose:
        """(K, 3) base poses of all keyframes, those of earlier drives first."""
        return self.session.map_from_base

    @cached_property
    def constraints(self) -> list[Constraint]:
        """Constraints between the bases of keyframes."""
        return list(self.session.constraints_between_bases())

    def points_in_space(self) -> Iterator[NDArray[np.float64]]:
        """(N, 3) metres in the map, z up from the base: each of the clouds or, if there are none, the
        returns of all keyframes at z = 0."""
        if not self.clouds:
            returns = self.session.points.astype(np.float64)
            yield np.column_stack([returns, np.zeros(len(returns))])
            return
        map_from_keyframe = self.session.map_from_keyframe[-len(self.keyframe_indices) :]
        for keyframe, cloud in self.clouds.items():
            points = transform_points(map_from_keyframe[keyframe], cloud[:, :2].astype(np.float64))
            yield np.column_stack([points, cloud[:, 2]])


def result_of(
    state: MapperState,
    session: Session,
    map_from_laser: Pose,
    drawn: DrawnMap,
    quality: MapQuality,
) -> MappingResult:
    """Result of a drive with scans at (N, 3), given the ``session`` of all drives."""
    laser_from_base = state.reckoning.mounts.laser_from_base(state.drive.lasers)
    map_from_base = compose(map_from_laser, laser_from_base)
    return MappingResult(
        session,
        drawn.tiled,
        state.config.rendering,
        Trajectory(np.array(state.drive.stamps, dtype=np.int64), map_from_base),
        quality,
        keyframe_indices=np.array(state.drive.keyframe_scans, dtype=np.int64),
        seconds=dict(state.seconds),
        counts=_counts(state, session),
        warnings=[*_warnings(state), *drawn.disregarded],
        clouds=state.clouds,
    )


def finished_map_of(state: MapperState, session: Session) -> FinishedMap:
    """The map to judge, of a drive within the ``session`` of all drives."""
    return FinishedMap(
        session,
        1.0 + state.reckoning.calibration.faults.distance,
        float(np.mean(state.refuted_steps)) if state.steps else 0.0,
    )


def views_of(state: MapperState, session: Session, map_from_laser: Pose) -> Views:
    """Rays and poses of all keyframes, and of scans at (N, 3) whose rays are still held."""
    of_keyframes = Views.of(session)
    held = list(state.held_rays)
    stamps = np.array(state.drive.stamps, dtype=np.int64)
    seconds_of_held = (stamps[held] - stamps[0]) * 1e-9
    return Views(
        rays=[*session.rays, *state.held_rays.values()],
        map_from_laser=np.concatenate([session.map_from_keyframe, map_from_laser[held]]),
        seconds=np.concatenate([of_keyframes.seconds, seconds_of_held]),
        drives=np.append(of_keyframes.drives, np.repeat(of_keyframes.drives[-1:], len(held))),
        keyframes=len(session.rays),
    )


def _counts(state: MapperState, session: Session) -> dict[str, int]:
    constraints = session.constraints
    return {
        "scans": len(state.drive),
        "keyframes": len(session.keyframes),
        "keyframes_kept": int(np.sum(session.keyframes.is_kept)),
        "keyframes_of_earlier_drives": len(session.keyframes) - len(state.keyframes),
        "scan_matching_constraints": int(constraints.are("scan_matching").sum()),
        "odometry_constraints": int(constraints.are("odometry").sum()),
        "loop_closures": int(constraints.are("loop_closure").sum()),
        "scans_without_odometry": state.reckoning.scans_without_odometry,
        **{f"loops_{name}": count for name, count in session.loops.log.items()},
    }


def _warnings(state: MapperState) -> list[str]:
    warnings = []
    if state.reckoning.scans_without_odometry == len(state.drive):
        warnings.append(WITHOUT_WHEELS)
    if sentence := state.reckoning.frozen.warning(state.drive.stamps[0]):
        warnings.append(sentence)
    if (finding := state.reckoning.turns.model.finding) is not None:
        warnings.append(finding.warning)
    if state.reckoning.scans_left_out > 0:
        warnings.append(
            f"{state.reckoning.scans_left_out} scans of further lasers were left out: without wheel odometry "
            "nothing shows the motion from one laser's scan to another's. Record odometry too, or map with "
            "one laser only."
        )
    lag = state.reckoning.odometry_lag.nanoseconds
    if abs(lag) >= NOTICEABLE:
        warnings.append(lag_finding(lag).warning)
    return warnings
