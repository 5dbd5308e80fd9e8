"""The ROS 2 node that maps while the car drives."""

import pickle
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from geometry_msgs.msg import PoseStamped
from pydantic import Field, field_validator

from racecar.mapping.grid.growing_grid import GrowingGrid
from racecar.mapping.mapper import Mapper
from racecar.mapping.state.growth import Growth
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, between, compose
from racecar.maps.settings import Settings
from racecar.pipelines.bags.converters.odometry import planar_pose
from racecar.pipelines.bags.messages import frame_name
from racecar.pipelines.bags.order import HeldScans
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.live.display.map_verdict import MapVerdict
from racecar.pipelines.live.display.mapper_display import MapperDisplay
from racecar.pipelines.live.display.words import mapper_headline, mapper_words
from racecar.pipelines.live.intake.first_messages import FirstMessages
from racecar.pipelines.live.intake.laser_place import LaserPlace
from racecar.pipelines.live.node import LiveNode
from racecar.pipelines.live.pause_service import PauseService
from racecar.pipelines.live.ros.foreign_parameters import SLAM_TOOLBOX, ForeignNode
from racecar.pipelines.live.ros.messages import fill_pose, header
from racecar.pipelines.live.saving.drive_log import AnotherDrive, Entry
from racecar.pipelines.live.saving.live_drive import LiveDrive
from racecar.pipelines.live.saving.map_saving import MapOutput
from racecar.pipelines.live.saving.save_service import SaveService
from racecar.pipelines.live.saving.unfinished_map import UnfinishedMap
from racecar.pipelines.live.work.free_memory import give_back_free_memory
from racecar.pipelines.live.work.schedule import Schedule
from racecar.pipelines.live.work.worker import Worker
from racecar.pipelines.runs.output_places import OccupiedError
from racecar.sensors.measurement import Measurement
from racecar.sensors.motion.odometry_buffer import OdometryBuffer
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

if TYPE_CHECKING:
    from racecar.pipelines.studio.watch.watch_screen import WatchScreen

_MESSAGES = {"scan": 25_000, "motion": 100_000}
"""Kinds of messages, and how many of each may wait: ten minutes, as long as mapping an hour again takes."""
_GIVE_BACK_EVERY = 0.3
"""Seconds between returns of free memory to the system, since each takes milliseconds."""
_HELD_FOR = 0.5
"""Seconds of silence after which a scan is mapped without odometry that covers it: as long as `HeldScans`
waits by the stamps."""
_TOLD_EVERY = 5.0
"""Seconds between log lines on what a stopping node still has to do. Chosen by judgement."""
_FIRST_TOLD = 0.5
"""Seconds before the first of them. Chosen by judgement, since people soon wonder."""
_LONGEST_BREAK = 100.0
"""Seconds of interruption after which a drive is not continued but recognized. Chosen by judgement: longer
than a restart, but too short to carry a car elsewhere."""
_PARAMETERS = ("resolution", "keyframe_distance", "keyframe_angle", "refine", "close_loops")
"""Settings that are ROS parameters, too: those of the whole, since the others have values that ROS lacks."""
_EXTENDED = (
    "The drive extends the map in {} when it is saved, where it is recognized; until then /map shows this "
    "drive alone."
)
_BEHIND = 1.0
"""Seconds of delay from which a warning is due. Chosen by judgement."""


class _EarlierMap(Settings):
    """An earlier map that the drive extends, as slam_toolbox's parameters say it."""

    map_file_name: str = Field("", description="folder of the earlier run whose map the drive extends")
    map_start_pose: tuple[float, ...] = Field(
        (0.0,),
        description="x, y (m) and yaw (rad) of the car on that map at the start; one 0 alone: searched for",
    )
    map_start_at_dock: bool = Field(False, description="the car starts where the first drive of that map did")

    @field_validator("map_start_pose")
    @classmethod
    def _check_pose(cls, numbers: tuple[float, ...]) -> tuple[float, ...]:
        if numbers != (0.0,) and len(numbers) != 3:
            raise ValueError("give x and y in metres and yaw in radians")
        return numbers

    @property
    def start(self) -> Pose | None:
        """(3,) as given; None if there is none."""
        return None if len(self.map_start_pose) == 1 else np.array(self.map_start_pose)


class MapperNode(LiveNode):
    """Maps a drive, publishes the car's pose on the map, and saves the map."""

    foreign: ClassVar[ForeignNode] = SLAM_TOOLBOX
    without: ClassVar[Mapping[str, str]] = {
        "scans": "the map stays as it is",
        "odometry": "the map rests on the scans alone",
    }

    def __init__(self, node: Any, drive: LiveDrive, view: "WatchScreen | None" = None) -> None:
        """Goes on with the drive. Raises UserError that names the invalid parameter."""
        super().__init__(node, "mapper", drive.output.config.sensors, moves_laser=False)
        config = self.declare(drive.output.config.mapping, read_only=True, only=_PARAMETERS)
        output = drive.output = self._extending(drive.output.with_settings(self.sensor_config, config))
        self.drive, self._log, self._view = drive, drive.log, view
        if not drive.mappers:
            drive.mappers.append(Mapper(config))
        if drive.place is not None:
            self.sensors.remember_place(drive.place)
        if (last := drive.last_stamp) is not None:
            self.sensors.carry_on(last)
        self._is_cut_short = False
        self._drawer = Worker("drawer", self.faults, self.survive)
        self._unfinished = UnfinishedMap(output, self.faults)
        for earlier in drive.mappers[:-1]:
            self._unfinished.leave_longer(earlier.growth.keyframes)
        self._display = MapperDisplay(
            node,
            self.parameters.map_frame,
            partial(GrowingGrid, config.resolution, config.rendering),
            self.side,
            self._drawer,
            self._unfinished.show,
            view,
            self.health,
        )
        self._verdict = MapVerdict(self.side)
        self._service = SaveService(
            node, lambda: self.drive.output, self._request_drives, self._extend, self.faults, self._note_saved
        )
        self._pause_service = PauseService(node, self.worker, self.faults)
        self._memory_schedule = Schedule()
        self._counts: Counter[str] = Counter()
        self._held = HeldScans(self._counts)
        self._first = FirstMessages(self.sensors.knows_place, self.sensors.understands)
        self._arrivals: dict[int, tuple[Any, int]] = {}
        self._last_scan = -(2**63)
        self._stated = OdometryBuffer()
        self._odom_frame = "odom"
        self._pose: Pose | None = None
        """The car at the last scan, on the map; None before there is one."""
        self._pose_by_odometry: Pose | None = None
        """The same as the odometry states it; None without odometry."""
        self._growth: Growth | None = None
        self._longest_backlog = 0.0
        self._pose_topic = node.create_publisher(PoseStamped, "tracked_pose", 10)

    def start(self) -> None:
        """Subscribe and start the threads."""
        self._drawer.start()
        if self._log.is_unread:
            self.worker.put("log", self._map_logged)
        super().start()
        self._service.start()
        self._pause_service.start()

    def stop(self) -> None:
        """Save the map as it is, map all messages received and stop; another Ctrl-C drops those that still
        wait."""
        self._display.end("The drive is over; its map is being finished and saved.")
        ending = Thread(target=self._end, name="ending", daemon=True)
        ending.start()
        seconds = _FIRST_TOLD
        while ending.is_alive():
            try:
                ending.join(seconds)
                seconds = _TOLD_EVERY
                if self._log.is_unread:
                    self.inform("The log is not mapped yet; press Ctrl-C again to save what there is.")
                elif scans := self.worker.backlog("scan"):
                    self.inform(f"{scans} scans to go; press Ctrl-C again to save what there is.")
            except KeyboardInterrupt:
                self._is_cut_short = True
                left_out = {kind: self.worker.clear(kind) for kind in _MESSAGES}
                self.inform(f"{left_out['scan']} scans are left out; the map shows those before.")

    def _end(self) -> None:
        self._unfinished.save()
        self._service.stop()
        self.stop_learning()
        self.worker.finish()
        self._take_rest()
        self._drawer.finish()
        self._unfinished.save()
        self.side.finish()

    @property
    def _mapper(self) -> Mapper:
        return self.drive.mappers[-1]

    def renewed(self) -> "MapperNode":
        """Maps on."""
        return MapperNode(self.node, self.drive, self._view)

    def figures(self) -> Mapping[str, Any]:
        """Figures of the growing map, as last passed on by the worker."""
        growth = self._growth or Growth()
        return {
            "keyframes": growth.keyframes,
            "submaps": growth.submaps,
            "messages waiting": sum(map(self.worker.backlog, _MESSAGES)),
            "times the map was drawn anew": self._display.times_redrawn,
            **self._verdict.figures,
        }

    def tell(self, wrong: list[str]) -> None:
        """Show on the page how much is mapped, and current faults."""
        headline = mapper_headline(self._verdict.quality, self.health.silence("scans"))
        self._display.tell(headline, mapper_words(self._growth, self._verdict.quality, wrong))

    def summary(self) -> dict[str, Any]:
        """Figures of the whole run, including the mapper's longest delay in seconds."""
        return {**super().summary(), "longest_backlog": self._longest_backlog}

    def take_scan(self, message: Any, arrival: int) -> None:
        """Let the worker map it."""
        self.worker.put("scan", partial(self._receive, True, message, arrival), _MESSAGES["scan"])

    def take_odometry(self, message: Any, arrival: int) -> None:
        """Add it in the worker, in turn."""
        self.worker.put("motion", partial(self._receive, False, message, arrival), _MESSAGES["motion"])

    def take_imu(self, message: Any, arrival: int) -> None:
        """Add it in the worker, in turn."""
        self.worker.put("motion", partial(self._receive_imu, message, arrival), _MESSAGES["motion"])

    def _receive_imu(self, message: Any, arrival: int) -> None:
        if not self._first.are_taken:
            return
        sample = self.sensors.yaw_rate(message, arrival)
        if sample is not None:
            self._hold(self.learning.yaw_rate(sample))

    def _receive(self, is_scan: bool, message: Any, arrival: int) -> None:
        if self._first.are_taken:
            self._note_backlog((time.monotonic_ns() - arrival) * 1e-9)
        for each in self._first.add(is_scan, message, arrival):
            self.worker.attempt(partial(self._convert, *each))

    def _note_backlog(self, seconds: float) -> None:
        self._longest_backlog = max(self._longest_backlog, seconds)
        if seconds > _BEHIND:
            self.faults.report(
                "behind", "The map is over a second behind the drive; it catches up.", lasting=False
            )

    def _convert(self, is_scan: bool, message: Any, arrival: int) -> None:
        if is_scan:
            scan = self.sensors.scan(message, arrival)
            if scan is None or not scan.is_return.any():
                return
            if not self._pause_service.is_paused:  # since the car may be carried meanwhile
                scan = self.learning.scan(scan)
            if scan.stamp <= self._last_scan:
                self.health.note("scans out of order")
                return
            self._last_scan = scan.stamp
            self._arrivals[scan.stamp] = self.stamp_of_scan(message), arrival
            self._hold(scan)
            return
        sample = self.sensors.odometry(message, arrival)
        sample = None if sample is None else self.learning.odometry(sample)
        if sample is not None:
            stated = planar_pose(message)
            self._odom_frame = frame_name(message.header.frame_id)
            if stated is not None:
                self._stated.add(Odometry(sample.stamp, stated, sample.twist))
            self._hold(sample)

    def watch(self) -> None:
        """Also release scans that wait for odometry once no messages arrive."""
        super().watch()
        worker, health = self.worker, self.health
        is_silent = min(health.silence("scans"), health.silence("odometry")) > _HELD_FOR
        if is_silent and not worker.backlog("rest"):
            worker.put("rest", self._take_rest)

    def _take_rest(self) -> None:
        self._take(self._held.rest())

    def _hold(self, item: Measurement) -> None:
        self._take(self._held.add(item))

    def _take(self, ready: Iterable[Measurement]) -> None:
        for item in ready:
            self.worker.attempt(partial(self._map, item))

    def _map_logged(self) -> None:
        """Map what the killed node had logged; new messages wait meanwhile."""
        began = time.monotonic()
        for entry in self._log.entries():
            if self._is_cut_short:
                return  # all of it stays in the log
            self.worker.attempt(partial(self._take_logged, entry))
        if (last := self._mapper.last_stamp) is not None:
            self.sensors.carry_on(last)
        self.inform(f"The drive until then is mapped again, in {time.monotonic() - began:.0f} s.")

    def _take_logged(self, entry: Entry) -> None:
        if isinstance(entry, LaserPlace):
            self.sensors.remember_place(entry)
        elif isinstance(entry, AnotherDrive):
            self._begin_another()
        else:
            feed(entry, self._mapper)

    def _keep(self, entry: Entry) -> None:
        """Log an entry; if that fails the drive continues without a log."""
        try:
            self._log.add(entry)
            self.faults.end("log", "The drive is logged again.")
        except OSError as error:
            self.faults.report("log", f"A killed node could not go on, as the drive is not logged: {error}")

    def _map(self, item: Measurement) -> None:
        if not isinstance(item, Scan):
            self._keep(item)
            feed(item, self._mapper)
            return
        stamp, arrival = self._arrivals.pop(item.stamp)
        by_odometry = self._odometry_at(item.stamp)
        if self._pause_service.is_paused:
            self._publish_paused(stamp, by_odometry)
            return
        if self._pose is None and (last := self._mapper.last_stamp) is not None:
            seconds = max((item.stamp - last) * 1e-9, self._log.broken_off or 0.0)
            self._log.broken_off = None
            if seconds > _LONGEST_BREAK:
                self._leave_earlier(seconds)
        if (place := self.sensors.place) is not None:
            self.drive.place = place
            self._keep(place)
        self._keep(item)
        self._pose = self._mapper.add_scan(item)
        self._growth, self._pose_by_odometry = self._mapper.growth, by_odometry
        self._publish(stamp, self._pose, by_odometry)
        self.judge_odometry(self._mapper.frozen_odometry)
        self.judge_turns(self._mapper.turn_model)
        self.health.note_latency((time.monotonic_ns() - arrival) * 1e-9)
        self._display.show(stamp, item, self._pose, self._mapper)
        self._verdict.judge_when_due(self._mapper.quality_so_far)
        if self._memory_schedule.is_due("memory", _GIVE_BACK_EVERY):
            self.side.put("memory", give_back_free_memory)

    def _leave_earlier(self, seconds: float) -> None:
        """Begin another drive, since the car may be anywhere on the map after so long an interruption."""
        self._keep(AnotherDrive())
        self._begin_another()
        self.inform(
            f"The drive was broken off {seconds:.0f} s ago, and the car may have been moved since: a map of "
            "its own is begun, which is joined to that of the drive before at the end, where that is "
            "recognized."
        )

    def _begin_another(self) -> None:
        self._unfinished.leave_longer(self._mapper.growth.keyframes)
        self.drive.mappers.append(Mapper(self.drive.output.config.mapping))
        self._display.begin_anew()

    def _odometry_at(self, stamp: int) -> Pose | None:
        """``odom_from_base`` (3,) as the odometry states it; None where it does not."""
        latest = self._stated.latest_stamp
        is_covered = latest is not None and abs(latest - stamp) < 10**9
        return self._stated.pose_at(stamp) if is_covered else None

    def _publish_paused(self, stamp: Any, by_odometry: Pose | None) -> None:
        """Publish the car where the odometry says that it has driven since the last scan that was mapped."""
        before, then = self._pose, self._pose_by_odometry
        if before is not None and then is not None and by_odometry is not None:
            self._publish(stamp, compose(before, between(then, by_odometry)), by_odometry)

    def _publish(self, stamp: Any, map_from_base: Pose, by_odometry: Pose | None) -> None:
        message = PoseStamped(header=header(stamp, self.parameters.map_frame))
        fill_pose(message.pose, map_from_base)
        self._pose_topic.publish(message)
        self.health.note("poses")
        self.transforms.publish(stamp, map_from_base, self._odom_frame, by_odometry)

    def _note_saved(self, sentence: str, folder: Path) -> None:
        if folder == self.drive.output.folder:
            self._unfinished.leave_finished()
        self.inform(sentence)

    def _extending(self, output: MapOutput) -> MapOutput:
        """The output of a drive that extends the map that the parameters name, if they do."""
        wanted = self.declare(_EarlierMap(), read_only=True)
        if output.continued is not None or not wanted.map_file_name:
            return output
        try:
            output = output.extending(
                Path(wanted.map_file_name), wanted.start, starts_at_first=wanted.map_start_at_dock
            )
        except OccupiedError:
            raise
        except UserError as error:
            self._warn(
                f"This drive has a map of its own, since the one of map_file_name is left out. {error}"
            )
        else:
            self.inform(_EXTENDED.format(wanted.map_file_name))
        return output

    def _extend(self, folder: Path, start: Pose | None, *, starts_at_first: bool) -> None:
        """Extend the map in a folder from now on; the car is at a pose (3,) there, or where the first drive
        of that map started, or it must be recognized. Raises UserError when there is no such map."""
        output = self.drive.output.extending(folder, start, starts_at_first=starts_at_first)
        if self.drive.mappers[:-1]:
            output = replace(output, start=None)  # that of the first of these drives is not known
        elif output.start is not None and self._pose is not None:
            since = between(self._pose, self._mapper.session().map_from_base[0])
            output = replace(output, start=compose(output.start, since))
        self.drive.output = output
        self.inform(_EXTENDED.format(folder))

    def _request_drives(self) -> Future[bytes]:
        """All drives between two messages, pickled; fails with a UserError if there are none yet."""
        taken: Future[bytes] = Future()

        def take() -> None:
            if self._pose is None:
                taken.set_exception(UserError("there is none yet, as no scan has arrived."))
            else:
                taken.set_result(pickle.dumps(self.drive.mappers))

        self.worker.put("save", take)
        return taken
