"""Frames and the links between them: where a sensor sits on the car, and which links move it."""

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.bags.messages import frame_name, rotation_matrix
from racecar.sensors.findings import Finding

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import geometry_msgs__msg__TransformStamped

_SAME = 1e-5
"""Variation of a fixed link in metres or entries of a rotation matrix. Publishers that recompute it round it
each time, while the wheels of a standing car jitter by more. Chosen by judgement."""
_APART = 0.05
"""Metres or radians by which a link leaps back and forth if two programs publish it; no car does so between
messages. Chosen by judgement."""
_CONTESTED = (10, 0.02)
"""Number of leaps, and their share of all messages, from which two programs publish a link. Chosen by
judgement: one of them may publish ten times as often as the other."""
_MENDED = 3
"""Most changes of a link that is being corrected; one that moves changes with each message. Chosen by
judgement."""
_WORLD = ("map", "world", "earth", "utm", "truth", "camera_init")
"""In names of frames fixed to the world, whose links are a solution or the truth: REP 105, and LOAM's."""
BASE_FRAMES = ("base_link", "base_footprint")
"""Frames of a car, as named by REP 105 and REP 120."""
_ODOMETRY = "odom"
"""In names of odometry frames, as in REP 105."""
_FARTHEST = 1e8
"""Metres between two frames; UTM coordinates stay below 1e7, and larger values come from damaged bytes."""


@dataclass(frozen=True, eq=False)
class SensorPlace:
    """A sensor's place on the car in 3D, and the part of it that a planar scan needs."""

    base_from_sensor: NDArray[np.float64]
    """(4, 4)"""
    source: str
    """Source of the place, for users."""
    base_frame: str = ""
    """The frame that stands for the car for this sensor; empty if unknown."""
    is_sure: bool = False
    """Whether that frame is certainly the car's."""
    findings: tuple[Finding, ...] = ()
    """Doubts about the place."""
    rival: Pose | None = None
    """(3,) another place that was published."""

    @staticmethod
    def from_pose(base_from_sensor: Iterable[float], source: str) -> "SensorPlace":
        """In the plane of the base, from x, y and yaw (3,). A fourth number is the roll about the sensor's x
        axis: π if it is mounted upside down."""
        x, y, yaw, roll = [*base_from_sensor, 0.0][:4]
        turned, rolled, matrix = np.eye(3), np.eye(3), np.eye(4)
        turned[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
        if roll != 0.0:
            rolled[1:, 1:] = [[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]]
        matrix[:3, :3] = turned @ rolled
        matrix[:2, 3] = x, y
        return SensorPlace(matrix, source)

    @property
    def pose(self) -> Pose:
        """(3,) ``base_from_laser``: position and direction of the sensor's x axis, seen from above."""
        return seen_from_above(self.base_from_sensor)

    @property
    def is_upside_down(self) -> bool:
        """Whether the sensor's bearings run clockwise, seen from above."""
        return bool(self.base_from_sensor[2, 2] < 0)

    @property
    def tilt(self) -> float:
        """Radians between the scan plane and the ground."""
        return float(np.arccos(np.clip(abs(self.base_from_sensor[2, 2]), 0.0, 1.0)))


def seen_from_above(matrix: NDArray[np.float64]) -> Pose:
    """(3,) position and direction of the x axis of a pose (4, 4)."""
    return np.array([matrix[0, 3], matrix[1, 3], np.arctan2(matrix[1, 0], matrix[0, 0])])


def inverted(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """The inverse (4, 4) of a pose."""
    return np.asarray(np.linalg.inv(pose), dtype=np.float64)


def last_name(frame: str) -> str:
    """The part ``base_link`` of ``robot1/base_link``, in lower case."""
    return frame.rpartition("/")[2].lower()


def namespace_of(topic: str) -> str:
    """The part ``/robot1`` of a topic or frame such as ``/robot1/tf``."""
    return topic.rpartition("/")[0]


def is_latched(topic: str) -> bool:
    """Whether the links on a topic are meant to be fixed."""
    return topic.rpartition("/")[2] == "tf_static"


def is_world_frame(frame: str) -> bool:
    """Whether a frame is fixed to the world by its name, so its links are not dead reckoning."""
    return any(part in last_name(frame) for part in _WORLD)


def is_odometry_frame(frame: str) -> bool:
    """Whether a frame is an odometry frame, by its name."""
    return _ODOMETRY in last_name(frame) and not is_world_frame(frame)


def matrix_of(transform: "geometry_msgs__msg__TransformStamped") -> NDArray[np.float64] | None:
    """``parent_from_child`` (4, 4); None if it has no valid pose."""
    rotation = rotation_matrix(transform.transform.rotation)
    translation = transform.transform.translation
    position = (translation.x, translation.y, translation.z)
    if rotation is None or not (np.abs(position) < _FARTHEST).all():
        return None
    parent_from_child = np.eye(4)
    parent_from_child[:3, :3] = rotation
    parent_from_child[:3, 3] = position
    return parent_from_child


def ends_of(transform: "geometry_msgs__msg__TransformStamped") -> tuple[str, str]:
    """Names of parent and child."""
    return frame_name(transform.header.frame_id), frame_name(transform.child_frame_id)


def _numbers(transform: "geometry_msgs__msg__TransformStamped") -> tuple[float, ...]:
    t, q = transform.transform.translation, transform.transform.rotation
    return (t.x, t.y, t.z, q.x, q.y, q.z, q.w)


class TransformTree:
    """Fixed transforms between frames."""

    def __init__(self) -> None:
        self._links: dict[str, dict[str, NDArray[np.float64]]] = {}
        self._parents: dict[str, str] = {}

    def add(self, transform: "geometry_msgs__msg__TransformStamped") -> None:
        """Add a transform; one without a valid pose is ignored."""
        parent_from_child = matrix_of(transform)
        if parent_from_child is not None:
            self.link(*ends_of(transform), parent_from_child)

    def link(self, parent: str, child: str, parent_from_child: NDArray[np.float64]) -> None:
        """Add a link between two frames with its pose (4, 4), unless its reverse was added before."""
        if self._parents.get(parent) == child:
            return
        self._parents[child] = parent
        self._links.setdefault(parent, {})[child] = parent_from_child
        self._links.setdefault(child, {})[parent] = inverted(parent_from_child)

    def between(self, target: str, source: str) -> NDArray[np.float64] | None:
        """``target_from_source`` (4, 4) over any number of links; None if the frames are not linked."""
        return self.around(target).get(source)

    def around(self, target: str) -> dict[str, NDArray[np.float64]]:
        """``target_from_frame`` (4, 4) of every frame linked to the target, nearest first."""
        found = {target: np.eye(4)}
        for frame, before in _nearest_first(target, self._links):
            found[frame] = found[before] @ self._links[before][frame]
        return found

    def top(self, frame: str) -> str:
        """The root frame, from which all links lead down to this one."""
        return self.line_up(frame)[-1]

    def line_up(self, frame: str) -> list[str]:
        """A frame and its ancestors, nearest first."""
        line = [frame]
        while (parent := self._parents.get(line[-1])) is not None and parent not in line:
            line.append(parent)
        return line


def _nearest_first(start: str, neighbours: Mapping[str, Iterable[str]]) -> Iterator[tuple[str, str]]:
    """Linked frames in breadth-first order, each with its predecessor on the path."""
    known, queue = {start}, deque([start])
    while queue:
        frame = queue.popleft()
        for neighbour in neighbours.get(frame, ()):
            if neighbour not in known:
                known.add(neighbour)
                queue.append(neighbour)
                yield neighbour, frame


@dataclass(eq=False)
class Link:
    """What was published so far about one frame in another."""

    parent: str
    child: str
    topic: str
    latest: NDArray[np.float64]
    """(4, 4) ``parent_from_child``"""
    is_latched: bool
    """Whether it was published as fixed."""
    numbers: tuple[float, ...]
    """The latest numbers, as published."""
    count: int = 1
    path: float = 0.0
    """Metres in the plane that the child moved, plus radians that it turned."""
    moves: bool = False
    changes: int = 0
    leaps: int = 0
    """How often it moved away and came back within two messages."""
    _first: NDArray[np.float64] | None = None
    _before: NDArray[np.float64] | None = None

    @property
    def ends(self) -> tuple[str, str]:
        """Parent and child."""
        return self.parent, self.child

    @property
    def is_contested(self) -> bool:
        """Whether two programs seem to publish it with different motions."""
        return self.leaps >= max(_CONTESTED[0], _CONTESTED[1] * self.count)

    def __str__(self) -> str:
        return f"{self.parent} -> {self.child}"

    def repeats(self, transform: "geometry_msgs__msg__TransformStamped") -> bool:
        """Whether a transform equals the last one, which takes a tenth of the time to check."""
        if _numbers(transform) != self.numbers:
            return False
        self.count += 1
        return True

    @property
    def is_mended(self) -> bool:
        """Whether it changed so rarely that it is being corrected."""
        return self.moves and self.changes <= _MENDED

    def take(self, parent_from_child: NDArray[np.float64], numbers: tuple[float, ...]) -> None:
        """Add the next pose (4, 4)."""
        self.numbers = numbers
        first = self.latest if self._first is None else self._first
        away = _motion(self.latest, parent_from_child)
        self.path += away
        if self._before is not None and away > _APART:
            self.leaps += _motion(self._before, parent_from_child) < 0.3 * away
        self._before = self.latest
        if float(np.abs(parent_from_child - self.latest).max()) > _SAME:
            self.changes += 1
        self.moves = self.moves or float(np.abs(parent_from_child - first).max()) > _SAME
        self._first, self.latest, self.count = first, parent_from_child, self.count + 1


def _motion(before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    """Metres plus radians in the plane between two poses (4, 4)."""
    x, y, turn = seen_from_above(inverted(before) @ after)
    return float(np.hypot(x, y)) + abs(float(turn))


@dataclass(frozen=True, eq=False)
class OdometryLinks:
    """Links from the odometry frame down to the car, which compose to the odometry."""

    frames: tuple[str, ...]
    """From the odometry frame to that of the car."""
    poses: tuple[NDArray[np.float64], ...]
    """(4, 4) of each frame in the previous one, as known in advance."""
    topics: tuple[str, ...]
    """Topics of the links that move."""
    driving: Link
    """The link that moves most; if it does not move, none does. Odometry has its stamps."""

    @property
    def base_frame(self) -> str:
        """The frame whose motion this is."""
        return self.frames[-1]

    def __str__(self) -> str:
        return f"{self.frames[0]} -> {self.base_frame}"


class FrameLinks:
    """All links that were published, on any topic; those that never change are fixed."""

    def __init__(self, *, takes_mended: bool = False) -> None:
        """With ``takes_mended``, links corrected while they are received also count as fixed."""
        self._takes_mended = takes_mended
        self._links: dict[tuple[str, str], Link] = {}
        self.contradicted: dict[tuple[str, str], NDArray[np.float64]] = {}
        """What else was published for a fixed link."""

    def __iter__(self) -> Iterator[Link]:
        return iter(self._links.values())

    @property
    def are_any(self) -> bool:
        """Whether anything was published."""
        return bool(self._links)

    def knows(self, frame: str) -> bool:
        """Whether a frame is linked to another."""
        return any(frame in ends for ends in self._links)

    def add(self, transform: "geometry_msgs__msg__TransformStamped", topic: str) -> Link | None:
        """Add a transform from a topic; a latched one takes precedence over others for the same link. Returns
        the link, None without a valid pose."""
        ends, is_latched_topic = ends_of(transform), is_latched(topic)
        known = self._links.get(ends)
        if known is not None and known.repeats(transform):
            return known
        pose = matrix_of(transform)
        if pose is None or ends[0] == ends[1]:
            return None
        if known is not None and known.is_latched and not is_latched_topic:
            if float(np.abs(pose - known.latest).max()) > _SAME:
                self.contradicted.setdefault(ends, pose)
        elif known is None or is_latched_topic:
            if known is not None and not known.moves and not (known.is_latched and self._takes_mended):
                self.contradicted.setdefault(ends, known.latest)
            self._links[ends] = known = Link(*ends, topic, pose, is_latched_topic, _numbers(transform))
        else:
            known.take(pose, _numbers(transform))
        return known

    def fixed(self) -> TransformTree:
        """Frames that are fixed to each other on the car."""
        tree = TransformTree()
        for link in self._of_the_car():
            if not link.moves or (self._takes_mended and link.is_mended):
                tree.link(link.parent, link.child, link.latest)
        return tree

    def circles(self, base: str, frame: str) -> Iterator[tuple[Link, NDArray[np.float64]]]:
        """The links that contradict the path from the base down to a frame, such as those that close a
        circle, with ``base_from_frame`` (4, 4) by each."""
        tree = self.fixed()
        around = tree.around(base)
        line = [each for each in tree.line_up(frame) if each != base]
        for link in self._of_the_car():
            on_line = [each for each in line if each in (link.parent, link.child)]
            if link.moves or not on_line or not {link.parent, link.child} <= set(around):
                continue
            if on_line[0] == link.child:
                by_link = around[link.parent] @ link.latest
            else:
                by_link = around[link.child] @ inverted(link.latest)
            if float(np.abs(by_link - around[on_line[0]]).max()) > _SAME:
                yield link, by_link @ inverted(around[on_line[0]]) @ around[frame]

    def _of_the_car(self) -> list[Link]:
        return [
            link
            for link in self
            if not any(is_world_frame(end) or is_odometry_frame(end) for end in (link.parent, link.child))
        ]

    def odometry(self, sensor_frame: str) -> OdometryLinks | None:
        """The links from an odometry frame to the part of the car with the sensor, if there are any.

        The odometry frame is known by its name, or else is the parent of the nearest moving link to the
        sensor. Links fixed to the world are not followed. For a sensor that is not linked to the car, the
        part is that of the base, known by its name or as the child of odometry.
        """
        tree = self.fixed()
        frames = {end for link in self for end in (link.parent, link.child)}
        named = sorted(frame for frame in frames if is_odometry_frame(frame))
        on_car = set(tree.around(sensor_frame))
        ways = [self._way_down(frame, on_car) for frame in named]
        if not any(ways):
            starts = {link.parent for link in self if self._carries(link, on_car)}
            ways = [self._way_down(frame, on_car) for frame in sorted(starts)]
        if not any(ways):
            bases = sorted(frame for frame in frames if last_name(frame) in BASE_FRAMES)
            bases = bases or sorted(link.child for link in self if is_odometry_frame(link.parent))
            parts = [set(tree.around(base)) for base in bases]
            ways = [self._way_down(frame, part) for frame in named for part in parts]
        candidates = [self._odometry_along(way) for way in ways if way]
        namespace = namespace_of(sensor_frame)

        def preference(links: OdometryLinks) -> tuple[bool, bool, bool, int, int]:
            start, driving = links.frames[0], links.driving
            is_of_robot = namespace_of(start) == namespace
            is_usual = last_name(start) == _ODOMETRY
            return driving.moves, is_of_robot, is_usual, -len(links.frames), driving.count

        return max(candidates, key=preference, default=None)

    def standing_odometry(self, odometry: OdometryLinks) -> list[Link]:
        """Links of a moving odometry that start at the odometry frame and never change, which their publisher
        cannot have intended."""
        ends = pairwise(odometry.frames)
        return [
            link
            for parent, child in ends
            if is_odometry_frame(parent) and (link := self._links.get((parent, child))) and not link.moves
        ]

    def solution(self) -> Link | None:
        """A link that moves in the world, such as that of a localizer."""
        moving = (link for link in self if link.moves and is_world_frame(link.parent))
        return next(moving, None)

    def _carries(self, link: Link, on_car: set[str]) -> bool:
        """Whether a link without a standard name moves the whole car instead of a part of it."""
        is_part = link.parent in on_car or "base" in last_name(link.parent)
        return link.moves and link.child in on_car and not is_part and not is_world_frame(link.parent)

    def _way_down(self, start: str, on_car: set[str]) -> list[str]:
        """The shortest path of frames from the start to the first on the car; empty if there is none. Each
        link may have been published in either direction."""
        neighbours: dict[str, list[str]] = {}
        for link in self:
            if not (is_world_frame(link.parent) or is_world_frame(link.child)):
                neighbours.setdefault(link.parent, []).append(link.child)
                neighbours.setdefault(link.child, []).append(link.parent)
        ways = {start: [start]}
        for frame, before in _nearest_first(start, neighbours) if start not in on_car else ():
            ways[frame] = [*ways[before], frame]
            if frame in on_car:
                return ways[frame]
        return []

    def _odometry_along(self, way: list[str]) -> OdometryLinks:
        links, poses = list[Link](), list[NDArray[np.float64]]()
        for parent, child in pairwise(way):
            link = self._links.get((parent, child)) or self._links[child, parent]
            links.append(link)
            poses.append(link.latest if link.parent == parent else inverted(link.latest))
        driving = max(links, key=lambda link: (link.moves, link.path))
        topics = {link.topic for link in links if link.moves} or {driving.topic}
        return OdometryLinks(tuple(way), tuple(poses), tuple(sorted(topics)), driving)
