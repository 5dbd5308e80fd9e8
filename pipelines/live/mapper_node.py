"""The node that maps while the car drives."""

import time
from collections import Counter
from collections.abc import Iterable, Mapping
from concurrent.futures import Future, TimeoutError
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Path as PathMessage
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from racecar.mapping.arrays import Arrays
from racecar.mapping.grid.growing_grid import GrowingGrid
from racecar.mapping.grid.rendering import Rays
from racecar.mapping.mapper import Snapshot
from racecar.mapping.session.session import Session
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.sensing.odometry import Odometry, OdometryBuffer
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.bags.converters.odometry import planar_pose
from racecar.pipelines.bags.messages import frame_name
from racecar.pipelines.bags.order import HeldScans
from racecar.pipelines.bags.replay import replay
from racecar.pipelines.live.driven_path import DrivenPath
from racecar.pipelines.live.free_memory import give_back_free_memory
from racecar.pipelines.live.intake.first_messages import FirstMessages
from racecar.pipelines.live.intake.laser_place import LaserPlace
from racecar.pipelines.live.map_saving import MapOutput
from racecar.pipelines.live.node import LATCHED, LiveNode
from racecar.pipelines.live.ros.bulk_messages import path_bytes
from racecar.pipelines.live.ros.graph_markers import graph_markers
from racecar.pipelines.live.ros.messages import fill_pose, grid_message, header
from racecar.pipelines.live.ros.parameters import declare
from racecar.pipelines.live.ros.run import sister_node
from racecar.pipelines.live.worker import Worker
from racecar.pipelines.runs.checkpoint import MappingStart

if TYPE_CHECKING:
    from racecar.pipelines.live.viewer import LiveView

_WORK = {"message": 20_000, "rest": 1, "save": 1}
_SIDE_WORK = {"graph": 1, "path": 1, "checkpoint": 1, "memory": 1, "view": 1}
_PERIODS = {"map": 0.5, "graph": 2.0, "path": 1.0, "memory": 0.3, "view": 0.5}
_CHECKPOINT_SHARE = 50.0
"""Times as long as writing takes: a long drive has a large checkpoint."""
_HELD_FOR = 0.5
"""Seconds of silence after which a scan is taken without the odometry that would cover it."""
_SNAPSHOT_SECONDS = 120.0
_BEHIND = 1.0
"""Seconds for which messages wait when that is worth telling."""


@dataclass(frozen=True, eq=False)
class _Taken:
    """What a checkpoint holds, as it was at one moment."""

    arrays: Snapshot
    messages: int
    besides: Arrays


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
        super().__init__(node, "mapper", _WORK, _SIDE_WORK, after=start.mapper.last_stamp)
        self._output, self._mapper, self._messages = output, start.mapper, start.messages
        place = LaserPlace.from_fields(start.besides)
        if place is not None:
            self.sensors.remember_place(place)
        self._view = view
        self._checkpoint = output.checkpoint()
        self._grid = GrowingGrid(output.config.resolution)
        self._drawer = Worker("drawer", {"map": 1}, self.faults, self.survive)
        """Draws the map; beside other work it would wait while a checkpoint is written."""
        self._counts: Counter[str] = Counter()
        self._held = HeldScans(self._counts)
        self._first = FirstMessages(self.sensors.knows_place)
        self._arrivals: dict[int, tuple[Any, int]] = {}
        self._last_scan = -(2**63)
        self._stated = OdometryBuffer()
        self._odom_frame = "odom"
        self._path = DrivenPath()
        self._pose: Pose | None = None
        self._longest_backlog = 0.0
        self._due = dict.fromkeys(_PERIODS, 0.0)
        self._checkpoint_every = self._declare_checkpoints()
        self._checkpoint_due = time.monotonic() + self._checkpoint_every
        self._service = ExitStack()
        create = node.create_publisher
        self._map_topic = create(OccupancyGridMessage, "map", LATCHED)
        self._graph_topic = create(MarkerArray, "pose_graph", LATCHED)
        self._path_topic = create(PathMessage, "path", LATCHED)
        self._pose_topic = create(PoseStamped, "tracked_pose", 10)

    def start(self) -> None:
        """Begin to listen."""
        self._drawer.start()
        super().start()
        saver = self._service.enter_context(sister_node(self.node, "racecar_map_saver"))
        saver.create_service(Trigger, "save_map", self._on_save)

    def stop(self) -> None:
        """Take in everything that has come, and stop."""
        self._service.close()
        self.worker.finish()
        self._take_rest()
        self._drawer.finish()
        self.side.finish()

    def save(self) -> None:
        """Settle the map of the stopped drive and write its files. Raises UserError when there is no map."""
        self._output.save(self._mapper)
        self._checkpoint.remove()

    def figures(self) -> Mapping[str, Any]:
        """How the map grows."""
        session = self._mapper.session()
        return {
            "keyframes": len(session.rays),
            "submaps": len(session.loops.submaps),
            "messages waiting": self.worker.inbox.backlog("message"),
            "times the map was drawn anew": self._grid.redrawn,
        }

    def summary(self) -> dict[str, Any]:
        """Figures of the whole run, also by how many seconds the mapper was behind at most."""
        return {**super().summary(), "longest_backlog": self._longest_backlog}

    def take_scan(self, message: Any, arrival: int) -> None:
        """Let the worker map it."""
        self.worker.inbox.put("message", partial(self._receive, True, message, arrival))

    def take_odometry(self, message: Any, arrival: int) -> None:
        """Let the worker take it in, in its turn."""
        self.worker.inbox.put("message", partial(self._receive, False, message, arrival))

    def _declare_checkpoints(self) -> float:
        meaning = "seconds between two checkpoints, from which the drive goes on when the node was killed"
        seconds = declare(self.node, "checkpoint_every", 15.0, meaning, read_only=True)
        if not isinstance(seconds, int | float) or not 0.1 <= seconds <= 86400.0:
            raise UserError(f"The parameter checkpoint_every is {seconds!r}; give seconds, at least 0.1.")
        return float(seconds)

    def _receive(self, is_scan: bool, message: Any, arrival: int) -> None:
        if self._first.are_taken:
            self._note_backlog((time.monotonic_ns() - arrival) * 1e-9)
        for each in self._first.add(is_scan, message, arrival):
            self._convert(*each)

    def _note_backlog(self, seconds: float) -> None:
        self._longest_backlog = max(self._longest_backlog, seconds)
        if seconds > _BEHIND:
            self.faults.tell(
                "behind", "The map is over a second behind the drive; it catches up.", lasting=False
            )

    def _convert(self, is_scan: bool, message: Any, arrival: int) -> None:
        self._messages += 1
        if is_scan:
            scan = self.sensors.scan(message, arrival)
            if scan is None or not scan.is_return.any():
                return
            if scan.stamp <= self._last_scan:
                self.health.note("scans out of order")
                return
            self._last_scan = scan.stamp
            self._arrivals[scan.stamp] = message.header.stamp, arrival
            self._hold(scan)
            return
        sample = self.sensors.odometry(message, arrival)
        if sample is not None:
            stated = planar_pose(message)
            self._odom_frame = frame_name(message.header.frame_id)
            if stated is not None:
                self._stated.add(Odometry(sample.stamp, stated, sample.twist))
            self._hold(sample)

    def watch(self) -> None:
        """Also: a scan waits for its odometry only while messages come."""
        super().watch()
        if min(self.health.silence("scans"), self.health.silence("odometry")) > _HELD_FOR:
            self.worker.inbox.put("rest", self._take_rest)

    def _take_rest(self) -> None:
        self._take(self._held.rest())

    def _hold(self, item: Scan | Odometry) -> None:
        self._take(self._held.add(item))

    def _take(self, ready: Iterable[Scan | Odometry]) -> None:
        for replayed in replay(ready, self._mapper):
            scan, self._pose = replayed.scan, replayed.answer
            stamp, arrival = self._arrivals.pop(scan.stamp)
            self._publish(stamp, scan, self._pose)
            self.health.note_latency((time.monotonic_ns() - arrival) * 1e-9)
            self._path.add(self._pose)
            self._show(stamp, scan, self._pose)
            self._save_checkpoint_when_due()
            if self._is_due("memory"):
                self.side.inbox.put("memory", give_back_free_memory)

    def _publish(self, stamp: Any, scan: Scan, map_from_base: Pose) -> None:
        message = PoseStamped(header=header(stamp, self.parameters.map_frame))
        fill_pose(message.pose, map_from_base)
        self._pose_topic.publish(message)
        self.health.note("poses")
        latest = self._stated.latest_stamp
        is_covered = latest is not None and abs(latest - scan.stamp) < 10**9
        stated = self._stated.pose_at(scan.stamp) if is_covered else None
        self.transforms.publish(stamp, map_from_base, self._odom_frame, stated)

    def _show(self, stamp: Any, scan: Scan, map_from_base: Pose) -> None:
        """What people look at, when it is due; another thread makes it."""
        if self._is_due("map"):
            session = self._mapper.session()
            poses = session.map_from_keyframe.copy()
            self._drawer.inbox.put("map", partial(self._publish_map, stamp, list(session.rays), poses))
        put = self.side.inbox.put
        if self._is_due("graph") and self.is_heard(self._graph_topic):
            put("graph", partial(self._publish_graph, stamp, self._mapper.session().frozen()))
        if self._is_due("path") and self.is_heard(self._path_topic):
            frame = self.parameters.map_frame
            put("path", lambda: self._path_topic.publish(path_bytes(stamp, frame, self._path.poses)))
        if self._view is not None and self._is_due("view"):
            put("view", partial(self._show_in_browser, self._view, scan, map_from_base))

    def _show_in_browser(self, view: "LiveView", scan: Scan, map_from_base: Pose) -> None:
        points = transform_points(map_from_base, scan.points_in_base())
        view.show(map_from_base, points, self._path.poses)

    def _is_due(self, what: str) -> bool:
        now = time.monotonic()
        if now < self._due[what]:
            return False
        self._due[what] = now + _PERIODS[what]
        return True

    def _publish_map(self, stamp: Any, rays: list[Rays], poses: Pose) -> None:
        grid = self._grid.draw(rays, poses)
        self._map_topic.publish(grid_message(stamp, self.parameters.map_frame, grid))
        self.health.note("maps")
        if self._view is not None:
            self._view.show_map(grid)

    def _publish_graph(self, stamp: Any, session: Session) -> None:
        self._graph_topic.publish(graph_markers(stamp, self.parameters.map_frame, session))

    def _save_checkpoint_when_due(self) -> None:
        if time.monotonic() < self._checkpoint_due:
            return
        self._checkpoint_due = float("inf")
        taken = self._snapshot()
        self.side.inbox.put("checkpoint", lambda: self._save_checkpoint(taken))

    def _save_checkpoint(self, taken: _Taken) -> None:
        began = time.monotonic()
        try:
            self._checkpoint.save(taken.arrays(), taken.messages, taken.besides)
            self.faults.end("checkpoint", "Checkpoints are written again.")
        except (UserError, OSError) as error:
            self.faults.tell("checkpoint", f"No checkpoint is written: {error}")
        now = time.monotonic()
        self._checkpoint_due = now + max(self._checkpoint_every, _CHECKPOINT_SHARE * (now - began))

    def _on_save(self, _request: Any, response: Any) -> Any:
        """Answers when the files are there. It has a thread of its own, and the work a process of its own,
        so the drive goes on meanwhile."""
        taken: Future[_Taken] = Future()
        self.worker.inbox.put("save", lambda: self._take_snapshot(taken))
        try:
            snapshot = taken.result(_SNAPSHOT_SECONDS)
            self._output.save_snapshot(snapshot.arrays(), snapshot.messages, snapshot.besides)
        except (UserError, OSError, RuntimeError, TimeoutError) as error:
            response.success, response.message = False, f"The map was not saved: {error}"
            self.faults.tell("saving", response.message, lasting=False)
            return response
        response.success, response.message = True, f"The map is saved in {self._output.folder}."
        self.inform(response.message)
        return response

    def _take_snapshot(self, taken: Future[_Taken]) -> None:
        if self._pose is None:
            taken.set_exception(UserError("there is none yet, as no scan has come."))
        else:
            taken.set_result(self._snapshot())

    def _snapshot(self) -> _Taken:
        place = self.sensors.place
        besides = {} if place is None else place.to_arrays()
        return _Taken(self._mapper.snapshot(), self._messages, besides)
