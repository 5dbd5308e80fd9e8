"""The ROS 2 node that localizes the car."""

import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Odometry as OdometryMessage
from pydantic import Field

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, inverse
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.settings import Settings
from racecar.pipelines.bags.converters.odometry import planar_pose, planar_twist
from racecar.pipelines.bags.messages import frame_name, nanoseconds
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.live.display.localizer_display import LocalizerDisplay
from racecar.pipelines.live.display.words import localizer_words
from racecar.pipelines.live.intake.first_messages import Arrived
from racecar.pipelines.live.monitoring.whereabouts import Whereabouts
from racecar.pipelines.live.node import LiveNode
from racecar.pipelines.live.remembered_pose import PoseMemory, RememberedPose
from racecar.pipelines.live.ros.foreign_parameters import AMCL, ForeignNode
from racecar.pipelines.live.ros.messages import grid_of, odometry_message, pose_message
from racecar.pipelines.live.ros.parameters import watch_settings
from racecar.pipelines.live.ros.qos import LATCHED
from racecar.pipelines.live.start_requests import StartRequests, initial_pose
from racecar.pipelines.live.work.schedule import Schedule
from racecar.pipelines.runs.view.headline import place_headline
from racecar.sensors.findings import Finding
from racecar.sensors.odometry import Odometry

if TYPE_CHECKING:
    from racecar.pipelines.studio.watch.watch_screen import WatchScreen

_MOST_SETTINGS = 4
"""Changes of settings that may wait: a person makes no more at once."""
_MOST_SCANS = 80
"""Scans that may wait: two seconds, which a car that is briefly slow catches up with."""
_REMEMBER_EVERY = 1.0
"""Seconds. Chosen by judgement: a killed node forgets no more than that."""

_OF_ONE_TIME = 1_000_000_000
"""Nanoseconds by which odometry may be older than a scan whose pose is saved with it. Chosen by judgement."""
_PATIENCE = 1_500_000_000
"""Nanoseconds for which the first scan waits. Chosen by judgement, since people wait for the first pose."""
_PATIENCE_AFTER_RESTART = 3_000_000_000
"""The same if odometry may show how far the car drove meanwhile: as long as DDS discovery takes."""
_TRAIL, _DISAGREED_FOR = 400, 3_000_000_000
"""Scans, and nanoseconds after which a disagreement of the clocks is certain, since even the slowest lasers
have sent five scans by then."""
_ASTRAY = 0.3
"""Metres, and half of it radians, of odometry error after some seconds. Chosen by judgement."""


@dataclass(frozen=True, eq=False)
class LocalizerStart:
    """How the localizer node starts, besides its parameters."""

    grid: OccupancyGrid | None
    """None: the map arrives on ``/map``."""
    initial_pose: Pose | None = None
    """(3,)"""
    anywhere: bool = False
    """Global localization: ignore the remembered pose."""
    memory: Path | None = None
    """Folder of the remembered poses; None to remember nothing."""
    seed: int = 0


class _MapTopic(Settings):
    """Where the map comes from without ``--map``, as AMCL's parameters say it."""

    map_topic: str = Field("map", description="topic of the map, before remapping")
    first_map_only: bool = Field(False, description="leave out every map that arrives after the first one")


class LocalizerNode(LiveNode):
    """Poses of the car on a map, at the rate of the odometry."""

    foreign: ClassVar[ForeignNode] = AMCL
    without: ClassVar[Mapping[str, str]] = {
        "scans": "the pose is carried on by odometry alone",
        "odometry": "the motion is guessed from scan to scan",
    }

    def __init__(
        self,
        node: Any,
        config: Config,
        start: LocalizerStart,
        view: "WatchScreen | None" = None,
    ) -> None:
        """Surveys the map. Raises UserError when that fails or a parameter is invalid."""
        super().__init__(node, "localizer", config.sensors, moves_laser=True)
        self._config = self.declare(config.localization)
        self._source = self.declare(_MapTopic(), read_only=True)
        if (pose := initial_pose(node)) is not None and start.initial_pose is None and not start.anywhere:
            start = replace(start, initial_pose=pose)
        self._begin, self._given, self._view = start, config, view
        self._maps_taken = 0
        self._localizer: Localizer | None = None
        self._grid: OccupancyGrid | None = None
        self._memory: PoseMemory | None = None
        self._remembered: RememberedPose | None = None
        """Until the car's current place is known."""
        self._is_asked = False
        self._estimate: PoseEstimate | None = None
        self._whereabouts = Whereabouts(self.inform)
        self._last_odometry: tuple[int, Odometry] | None = None
        self._first_scans: list[Arrived] = []
        self._is_understood = False
        self._base_from_laser: Pose | None = None
        self._trail: deque[tuple[int, Pose, Pose]] = deque(maxlen=_TRAIL)
        self._memory_schedule = Schedule()
        map_frame = self.parameters.map_frame
        self._display = LocalizerDisplay(
            node, map_frame, self.side, view, publishes_map=start.grid is not None
        )
        self._requests = StartRequests(node, map_frame, self.worker, self._localizer_to_start, self.inform)
        self._odometry_topic = node.create_publisher(OdometryMessage, "pf/pose/odom", 10)
        self._pose_topic = node.create_publisher(PoseWithCovarianceStamped, "amcl_pose", LATCHED)
        if start.grid is not None:
            self._take_localizer(start.grid, self._new_localizer(start.grid))
        watch_settings(node, lambda: self._config, self._on_settings)

    def start(self) -> None:
        """Subscribe and start the threads."""
        node = self.node
        self._requests.start()
        if self._begin.grid is None:
            topic = self._source.map_topic
            node.create_subscription(OccupancyGridMessage, topic, self._on_map, LATCHED)
            self.faults.report("no_map", f"No map has arrived on {node.resolve_topic_name(topic)} yet.")
        super().start()
        if self._grid is not None:
            self._display.show_map(self._grid)
            self._say_ready(self._grid)

    def stop(self) -> None:
        """Finish waiting work, save the pose and stop."""
        self._display.end("The node has ended")
        super().stop()
        self._remember()

    def renewed(self) -> "LocalizerNode":
        """Starts from the remembered pose, unless the car was never found."""
        start = self._begin
        if self._estimate is not None and self._estimate.is_place_known:
            start = replace(start, initial_pose=None, anywhere=False)
        return LocalizerNode(self.node, self._given, start, self._view)

    def figures(self) -> Mapping[str, Any]:
        """Figures of the last estimate."""
        localizer, estimate = self._localizer, self._estimate
        if localizer is None or estimate is None:
            return {}
        faults = localizer.calibration.faults
        return {
            "particles": estimate.particle_count,
            "effective sample size": float(estimate.effective_sample_size),
            "lost probability": float(estimate.lost_probability),
            "weight of the place": float(estimate.cluster_weight),
            "deviation (m)": estimate.deviation,
            **self._whereabouts.figures,
            "distance that odometry leaves out": faults.distance,
            "turn that odometry leaves out": faults.turn,
            "trim of the steering (rad/m)": faults.trim,
            "turn of the laser against its transform (rad)": localizer.calibration.laser_turn,
        }

    def tell(self, wrong: list[str]) -> None:
        """Show on the page whether the car is localized, and current faults."""
        headline = place_headline(self._estimate, self.health.silence("scans with returns"))
        drive = None if self._estimate is None else self._whereabouts.quality
        self._display.tell(headline, localizer_words(drive, wrong))

    def take_scan(self, message: Any, arrival: int) -> None:
        """Let the worker localize it."""
        self.worker.put("scan", partial(self._receive_scan, message, arrival), _MOST_SCANS)

    def take_odometry(self, message: Any, arrival: int) -> None:
        """Add the sample and publish the current pose, without waiting for the worker."""
        sample = self.sensors.odometry(message, arrival)
        if sample is None:
            return
        localizer, stated = self._localizer, planar_pose(message)
        sample = self.learning.odometry(sample)
        if sample is None:
            return
        self._last_odometry = nanoseconds(message.header.stamp), sample
        if localizer is None:
            return
        if self._remembered is not None and not self._is_asked:
            self._is_asked = True
            self.worker.put("place", partial(self._start_from_memory, self._last_odometry))
        localizer.add_odometry(sample)
        if self.sensors.was_corrected():
            self._start_from_trail(arrival, sample)
        estimate = localizer.pose_at(sample.stamp)
        if estimate is not None:
            stamp, odom_frame = self.stamp_of(message), frame_name(message.header.frame_id)
            self._publish_odometry(stamp, estimate, planar_twist(message))
            self.transforms.publish(stamp, estimate.map_from_base, odom_frame, stated)

    def take_imu(self, message: Any, arrival: int) -> None:
        """Add the sample, without waiting for the worker."""
        localizer = self._localizer
        sample = self.sensors.yaw_rate(message, arrival)
        if sample is not None:
            sample = self.learning.yaw_rate(sample)
            if localizer is not None:
                localizer.add_yaw_rate(sample)

    def _new_localizer(self, grid: OccupancyGrid) -> Localizer:
        """With its own random numbers, since the previous localizer runs while this one is built."""
        self._maps_taken += 1
        rng = np.random.default_rng([self._begin.seed, self._maps_taken])
        return Localizer(grid, self._config, rng)

    def _take_localizer(self, grid: OccupancyGrid, localizer: Localizer) -> None:
        """Switch to a map, keeping the car's pose if it fits the new map.

        Raises UserError when the start given by the user is not on the map; global localization starts then.
        """
        before, self._estimate = self._estimate, None
        self._memory = PoseMemory(self._begin.memory, grid) if self._begin.memory is not None else None
        self._grid, self._localizer = grid, localizer
        self._whereabouts = Whereabouts(self.inform)
        if before is not None:
            localizer.set_pose(before.map_from_base, before.covariance + np.diag([0.01, 0.01, 0.01]))
        elif self._begin.initial_pose is not None:
            localizer.set_pose(self._begin.initial_pose)
        elif not self._begin.anywhere and self._memory is not None:
            self._recall(self._memory)

    def _recall(self, memory: PoseMemory) -> None:
        try:
            remembered = memory.load()
        except UserError as error:
            self.faults.report("memory", f"The start is searched for: {error}", lasting=False)
            return
        if remembered is not None and remembered.laser is not None:
            self.sensors.remember_place(remembered.laser)
        self._remembered = remembered

    def _start_from_memory(self, odometry: tuple[int, Odometry] | None) -> None:
        """Start from the remembered pose, moved by any odometry that kept counting while no node ran."""
        remembered = self._remembered
        if remembered is None:
            return
        carried = None
        if odometry is not None:
            carried = remembered.carried_to(odometry[0], odometry[1].odom_from_base)
        if carried is None:
            self.inform(
                "No odometry says how far the car drove since the last run, as it started again or is "
                "silent: the search for the car starts where it was then."
            )
        self._requests.start_from(*(carried or remembered.left_there))

    def _localizer_to_start(self) -> Localizer | None:
        """The localizer for a start set by people, which overrides the remembered pose."""
        self._remembered = None
        return self._localizer

    def _start_from_trail(self, arrival: int, sample: Odometry) -> None:
        """Restart from a pose before the clocks disagreed, moved by the odometry since then. Wrong stamps had
        moved the car by odometry of other moments, but the odometry itself is right."""
        trail = list(self._trail)
        self._trail.clear()
        for then, map_from_base, odom_from_base in reversed(trail):
            if arrival - then > _DISAGREED_FOR:
                step = between(odom_from_base, sample.odom_from_base)
                spread = np.array([_ASTRAY, _ASTRAY, _ASTRAY / 2])
                self._requests.set_pose(compose(map_from_base, step), np.diag(spread**2))
                return

    def _receive_scan(self, message: Any, arrival: int) -> None:
        """Hold back the first scans, for a limited time, until their interpretation, the laser's place and
        the distance driven since the pose was saved are known: errors in these mislead the filter."""
        if self._localizer is None:
            return
        self._first_scans.append((True, message, arrival))
        if not self._is_understood:
            is_known = self.sensors.knows_place(message) and self.sensors.reads(self._first_scans)
            waited = arrival - self._first_scans[0][2]
            awaits_odometry = self._remembered is not None and waited < _PATIENCE_AFTER_RESTART
            if awaits_odometry or (not is_known and waited < _PATIENCE):
                return
            self._is_understood = True
            self.worker.attempt(partial(self._start_from_memory, None))
        waiting, self._first_scans = self._first_scans, []
        for _, each, came in waiting:
            self._locate(self._localizer, each, came)

    def _locate(self, localizer: Localizer, message: Any, arrival: int) -> None:
        scan = self.sensors.scan(message, arrival)
        if scan is None:
            return
        scan = self.learning.scan(scan)
        if scan.laser == 0:
            self._follow_laser(localizer, scan.base_from_laser)
        estimate = localizer.add_scan(scan)
        if estimate.stamp != scan.stamp:
            self.health.note("scans out of order")
            return
        stamp = self.stamp_of_scan(message)
        self._estimate = estimate
        covariance = estimate.covariance
        self._pose_topic.publish(
            pose_message(stamp, self.parameters.map_frame, estimate.map_from_base, covariance)
        )
        if self.health.silence("odometry") > 0.5 or not self.learning.uses_odometry:
            self._publish_odometry(stamp, estimate, IDENTITY)
            self.transforms.publish(stamp, estimate.map_from_base, "", None)
        self.health.note_latency((time.monotonic_ns() - arrival) * 1e-9)
        if scan.is_return.any():
            self.health.note("scans with returns")
            self._whereabouts.follow(estimate)
            is_lost = self._whereabouts.may_be_lost
            self.faults.judge(is_lost, Finding("lost"), "The scans fit the map again.")
        self.judge_odometry(localizer.frozen_odometry)
        self.judge_turns(localizer.turn_model)
        warning = localizer.calibration.laser_warning
        finding, ended = Finding("laser_turned", warning=warning), "The laser looks where its transform says."
        self.faults.judge(warning is not None, finding, ended)
        if self._last_odometry is not None and not estimate.is_lost:
            self._trail.append((arrival, estimate.map_from_base, self._last_odometry[1].odom_from_base))
        self._display.show(stamp, localizer.calibration.turned(scan), estimate, localizer)
        if self._memory_schedule.is_due("memory", _REMEMBER_EVERY):
            self.side.put("memory", self._remember)

    def _follow_laser(self, localizer: Localizer, base_from_laser: Pose) -> None:
        """If the laser turns out to sit elsewhere on the car, correct the car's pose on the map."""
        before, self._base_from_laser = self._base_from_laser, base_from_laser
        estimate = self._estimate
        if estimate is None or before is None or np.array_equal(before, base_from_laser):
            return
        moved = compose(before, inverse(base_from_laser))
        localizer.set_pose(compose(estimate.map_from_base, moved), estimate.covariance + np.eye(3) * 0.01)

    def _publish_odometry(self, stamp: Any, estimate: PoseEstimate, twist: Pose) -> None:
        parameters = self.parameters
        self._odometry_topic.publish(
            odometry_message(
                stamp,
                parameters.map_frame,
                self.sensors.base_frame,
                estimate.map_from_base,
                estimate.covariance,
                twist,
            )
        )
        self.health.note("poses")

    def _remember(self) -> None:
        """Save the pose, if it is certain."""
        localizer, estimate, odometry = self._localizer, self._estimate, self._last_odometry
        if self._memory is None or localizer is None or estimate is None:
            return
        if not estimate.is_place_known:
            return
        stamp, odom_from_base = None, None
        if odometry is not None and estimate.stamp - odometry[1].stamp < _OF_ONE_TIME:
            stamp, sample = odometry
            estimate, odom_from_base = localizer.pose_at(sample.stamp) or estimate, sample.odom_from_base
        pose = RememberedPose.model_construct(
            map_from_base=estimate.map_from_base,
            covariance=estimate.covariance,
            odometry_stamp=stamp,
            odom_from_base=odom_from_base,
            laser=self.sensors.place,
        )
        try:
            self._memory.save(pose)
            self.faults.end("memory", "The pose is remembered again.")
        except UserError as error:
            self.faults.report("memory", f"The pose is not remembered for the next start: {error}")

    def _on_settings(self, config: LocalizationConfig) -> None:
        def work() -> None:
            if self._localizer is not None:
                self._localizer.reconfigure(config)

        self._config = config
        self.worker.put("settings", work, _MOST_SETTINGS)

    def _on_map(self, message: Any) -> None:
        """Survey a new map, which takes a moment if it is large; the old one is used until then."""

        def build() -> None:
            grid = grid_of(message)
            known = self._grid
            if known is not None and (self._source.first_map_only or _is_same(grid, known)):
                return
            localizer = self._new_localizer(grid)
            self.worker.put("map", lambda: self._switch_to(grid, localizer))

        self.side.put("map", build)

    def _switch_to(self, grid: OccupancyGrid, localizer: Localizer) -> None:
        is_first = self._localizer is None
        localizer.reconfigure(self._config)  # may have changed while its table was built
        size = _size_in_words(grid)
        self.faults.end("no_map", f"The map has arrived, {size}.")
        if not is_first:
            self.faults.report(
                "map", f"Another map has arrived, {size}; the car is located on it.", lasting=False
            )
        self._display.show_map(grid)
        self._take_localizer(grid, localizer)
        if is_first:
            self._say_ready(grid)

    def _say_ready(self, grid: OccupancyGrid) -> None:
        self.inform(f"Ready: each scan is now laid on a map of {_size_in_words(grid)}.")


def _size_in_words(grid: OccupancyGrid) -> str:
    rows, columns = grid.cells.shape
    return f"{columns * grid.resolution:.1f} × {rows * grid.resolution:.1f} m"


def _is_same(grid: OccupancyGrid, known: OccupancyGrid) -> bool:
    return (
        grid.resolution == known.resolution
        and np.array_equal(grid.map_from_grid, known.map_from_grid)
        and np.array_equal(grid.cells, known.cells)
    )
