"""The node that maps while the car drives."""

import time
from collections import Counter
from collections.abc import Iterable, Mapping
from concurrent.futures import Future
from functools import partial
from threading import Thread
from typing import TYPE_CHECKING, Any, ClassVar

from geometry_msgs.msg import PoseStamped

from racecar.mapping.grid.growing_grid import GrowingGrid
from racecar.mapping.mapper import Mapper
from racecar.mapping.state.growth import Growth
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.measurement import Measurement
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.odometry_buffer import OdometryBuffer
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.bags.converters.odometry import planar_pose
from racecar.pipelines.bags.messages import frame_name
from racecar.pipelines.bags.order import HeldScans
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.live.display.map_verdict import VERDICT_WORK, MapVerdict
from racecar.pipelines.live.display.mapper_display import DISPLAY_WORK, DRAWING_WORK, MapperDisplay
from racecar.pipelines.live.display.words import mapper_words
from racecar.pipelines.live.intake.first_messages import FirstMessages
from racecar.pipelines.live.intake.laser_place import LaserPlace
from racecar.pipelines.live.node import LiveNode
from racecar.pipelines.live.ros.messages import fill_pose, header
from racecar.pipelines.live.saving.drive_checkpoints import CHECKPOINT_WORK, DriveCheckpoints, DriveSnapshot
from racecar.pipelines.live.saving.map_saving import MapOutput
from racecar.pipelines.live.saving.save_service import SaveService
from racecar.pipelines.live.work.free_memory import give_back_free_memory
from racecar.pipelines.live.work.schedule import Schedule
from racecar.pipelines.live.work.worker import Worker
from racecar.pipelines.runs.checkpoint import MappingStart

if TYPE_CHECKING:
    from racecar.pipelines.live.display.browser_view import LiveView

_MESSAGES = {"scan": 10_000, "motion": 20_000}
"""Kinds of messages, and how many of each may wait: some minutes of them, as a loop may take a while to
close."""
_WORK = {**_MESSAGES, "rest": 1, "save": 1}
_SIDE_WORK = {**CHECKPOINT_WORK, **DISPLAY_WORK, **VERDICT_WORK, "memory": 1}
_GIVE_BACK_EVERY = 0.3
"""Seconds between two times that free memory goes back to the machine, as each takes milliseconds."""
_HELD_FOR = 0.5
"""Seconds of silence after which a scan is taken without the odometry that would cover it: as long as
`HeldScans` waits by the stamps."""
_TOLD_EVERY = 5.0
"""Seconds between two lines on what a node that ends still does: by judgement."""
_FIRST_TOLD = 0.5
"""The same before the first one, as people wonder soon: by judgement."""
_LONGEST_BREAK = 100.0
"""Seconds after which a drive is not gone on with but recognized: by judgement, longer than it takes to write
a checkpoint of a long drive and to start again, and short for somebody who carries a car elsewhere."""
_BEHIND = 1.0
"""Seconds for which messages wait when that is worth reporting: by judgement."""


class MapperNode(LiveNode):
    """The map of the drive so far, the car's place on it, and files of it."""

    without: ClassVar[Mapping[str, str]] = {
        "scans": "the map stays as it is",
        "odometry": "the map rests on the scans alone",
    }

    def __init__(
        self, node: Any, output: MapOutput, start: MappingStart, view: "LiveView | None" = None
    ) -> None:
        """Raises UserError that names a parameter at fault."""
        super().__init__(
            node,
            "mapper",
            _WORK,
            _SIDE_WORK,
            after=start.mapper.last_stamp,
            moves_laser=False,
        )
        self._output, self._mapper, self._messages = output, start.mapper, start.messages
        place = LaserPlace.from_fields(start.besides)
        if place is not None:
            self.sensors.remember_place(place)
        self._drawer = Worker("drawer", DRAWING_WORK, self.faults, self.survive)
        config = output.config
        self._display = MapperDisplay(
            node,
            self.parameters.map_frame,
            partial(GrowingGrid, config.resolution, config.rendering),
            self.side,
            self._drawer,
            view,
            self.health,
        )
        self._checkpoints = DriveCheckpoints(node, output.checkpoint(), self.side, self.faults, self.inform)
        self._verdict = MapVerdict(self.side)
        self._service = SaveService(node, output, self._request_snapshot, self.faults, self.inform)
        self._memory_schedule = Schedule({"memory": _GIVE_BACK_EVERY})
        self._counts: Counter[str] = Counter()
        self._held = HeldScans(self._counts)
        self._first = FirstMessages(self.sensors.knows_place, self.sensors.understands)
        self._arrivals: dict[int, tuple[Any, int]] = {}
        self._last_scan = -(2**63)
        self._stated = OdometryBuffer()
        self._odom_frame = "odom"
        self._broken_off = start.seconds_ago
        self._pose: Pose | None = None
        self._growth = Growth()
        self._longest_backlog = 0.0
        self._pose_topic = node.create_publisher(PoseStamped, "tracked_pose", 10)

    def start(self) -> None:
        """Begin to listen."""
        self._drawer.start()
        super().start()
        self._service.start()

    def stop(self) -> None:
        """Take in everything that has come, and stop; another Ctrl-C leaves out what still waits."""
        self._display.end()
        ending = Thread(target=self._end, name="ending", daemon=True)
        ending.start()
        seconds = _FIRST_TOLD
        while ending.is_alive():
            try:
                ending.join(seconds)
                seconds = _TOLD_EVERY
                if scans := self.worker.inbox.backlog("scan"):
                    self.inform(f"{scans} scans to go; press Ctrl-C again to save what there is.")
            except KeyboardInterrupt:
                left_out = {kind: self.worker.inbox.clear(kind) for kind in _MESSAGES}
                self.inform(f"{left_out['scan']} scans are left out; the map shows those before.")

    def _end(self) -> None:
        self._service.stop()
        self.stop_learning()
        self.worker.finish()
        self._take_rest()
        self._drawer.finish()
        self.side.finish()

    def save(self) -> list[str]:
        """Finish the map of the stopped drive and write its files; where that fails, or is broken off, the
        drive is kept as a checkpoint. Returns what is to be said of it, and raises UserError when there is no
        map."""
        before = None if self._mapper.last_stamp is None else self._snapshot()
        try:
            said = self._output.save([*self._checkpoints.earlier(self._output.config), self._mapper])
        except BaseException:
            if before is not None:
                self._checkpoints.keep(before)
            raise
        self._checkpoints.remove()
        return said

    def figures(self) -> Mapping[str, Any]:
        """How the map grows, as the worker handed it over."""
        return {
            "keyframes": self._growth.keyframes,
            "submaps": self._growth.submaps,
            "messages waiting": sum(map(self.worker.inbox.backlog, _MESSAGES)),
            "times the map was drawn anew": self._display.times_redrawn,
            **self._verdict.figures,
        }

    def tell(self, wrong: list[str]) -> None:
        """Say on the page how much is mapped, and what is wrong."""
        self._display.tell(mapper_words(self._display.growth, self._verdict.quality, wrong))

    def summary(self) -> dict[str, Any]:
        """Figures of the whole run, also by how many seconds the mapper was behind at most."""
        return {**super().summary(), "longest_backlog": self._longest_backlog}

    def take_scan(self, message: Any, arrival: int) -> None:
        """Let the worker map it."""
        self.worker.inbox.put("scan", partial(self._receive, True, message, arrival))

    def take_odometry(self, message: Any, arrival: int) -> None:
        """Let the worker take it in, in its turn."""
        self.worker.inbox.put("motion", partial(self._receive, False, message, arrival))

    def take_imu(self, message: Any, arrival: int) -> None:
        """Let the worker take it in, in its turn."""
        self.worker.inbox.put("motion", partial(self._receive_imu, message, arrival))

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
        self._messages += 1
        if is_scan:
            scan = self.sensors.scan(message, arrival)
            if scan is None or not scan.is_return.any():
                return
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
        """Also: a scan waits for its odometry only while messages come."""
        super().watch()
        inbox, health = self.worker.inbox, self.health
        is_silent = min(health.silence("scans"), health.silence("odometry")) > _HELD_FOR
        if is_silent and not inbox.backlog("rest"):
            inbox.put("rest", self._take_rest)

    def _take_rest(self) -> None:
        self._take(self._held.rest())

    def _hold(self, item: Measurement) -> None:
        self._take(self._held.add(item))

    def _take(self, ready: Iterable[Measurement]) -> None:
        for item in ready:
            self.worker.attempt(partial(self._map, item))

    def _map(self, item: Measurement) -> None:
        if not isinstance(item, Scan):
            feed(item, self._mapper)
            return
        stamp, arrival = self._arrivals.pop(item.stamp)
        if self._pose is None and (last := self._mapper.last_stamp) is not None:
            seconds = max((item.stamp - last) * 1e-9, self._broken_off)
            if seconds > _LONGEST_BREAK:
                self._begin_anew(seconds)
        self._pose = self._mapper.add_scan(item)
        self._growth = self._mapper.growth
        self._publish(stamp, item, self._pose)
        self.judge_odometry(self._mapper.frozen_odometry)
        self.judge_turns(self._mapper.turn_model)
        self.health.note_latency((time.monotonic_ns() - arrival) * 1e-9)
        self._display.show(stamp, item, self._pose, self._mapper)
        self._checkpoints.save_when_due(self._snapshot)
        self._verdict.judge_when_due(self._mapper.quality_so_far)
        if self._memory_schedule.is_due("memory"):
            self.side.inbox.put("memory", give_back_free_memory)

    def _begin_anew(self, seconds: float) -> None:
        """The car was left alone for so long that nobody knows where it is on the map."""
        self._checkpoints.set_aside()
        self._mapper, self._messages = Mapper(self._output.config), 0
        self._display.begin_anew()
        self.inform(
            f"The drive was broken off {seconds:.0f} s ago, and the car may have been moved since: a map of "
            "its own is begun, which is joined to that of the drive before at the end, where that is "
            "recognized."
        )

    def _publish(self, stamp: Any, scan: Scan, map_from_base: Pose) -> None:
        message = PoseStamped(header=header(stamp, self.parameters.map_frame))
        fill_pose(message.pose, map_from_base)
        self._pose_topic.publish(message)
        self.health.note("poses")
        latest = self._stated.latest_stamp
        is_covered = latest is not None and abs(latest - scan.stamp) < 10**9
        stated = self._stated.pose_at(scan.stamp) if is_covered else None
        self.transforms.publish(stamp, map_from_base, self._odom_frame, stated)

    def _request_snapshot(self) -> Future[DriveSnapshot]:
        """Of the drive between two messages; a UserError where there is nothing of it yet."""
        taken: Future[DriveSnapshot] = Future()

        def take() -> None:
            if self._pose is None:
                taken.set_exception(UserError("there is none yet, as no scan has arrived."))
            else:
                taken.set_result(self._snapshot())

        self.worker.inbox.put("save", take)
        return taken

    def _snapshot(self) -> DriveSnapshot:
        place = self.sensors.place
        besides = {} if place is None else place.to_arrays()
        return DriveSnapshot(self._mapper.snapshot(), self._messages, besides)
