"""ROS in one thread and at a clock of its own: a minute of driving takes as long as the computer works on it.

Nodes, their names and their parameters are the real ones. Only there is no DDS, whatever is published arrives
as soon as the one who published it is done, and the nodes' workers are so fast that nothing waits for them.
"""

import heapq
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import count
from math import ceil
from threading import Thread
from types import SimpleNamespace
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSCompatibility, QoSProfile, qos_check_compatible
from rclpy.serialization import deserialize_message, serialize_message

from racecar.pipelines.live import localizer_node, mapper_node, player, simulator_node  # noqa: F401
from racecar.pipelines.live.ros.message_types import DECLARED, message_class
from racecar.pipelines.live.saving import save_service
from racecar.pipelines.live.work.worker import Worker

_TICK = 20_000_000
"""Nanoseconds between two looks at whether something that is waited for is there."""


class Bus:
    """What nodes publish, subscribe to and serve, and the time."""

    def __init__(self, context: Context) -> None:
        self.context = context
        self.monotonic = time.monotonic_ns()
        """Nanoseconds, as the nodes see them; their clocks on the wall agree with the computer's at first."""
        self._wall = time.time_ns() - self.monotonic
        self.log: list[str] = []
        """What the nodes have said, as ``[WARN] Something is wrong.``."""
        self.are_workers_held_up = False
        """Whether whatever the nodes let their workers do waits."""
        self.nodes: list[BusNode] = []
        self.publishers: list[Publisher] = []
        self.subscriptions: list[Subscription] = []
        self.services: dict[str, tuple[Any, Callable[..., Any]]] = {}
        self.mail: deque[tuple[Subscription, Any]] = deque()
        self._workers: list[Worker] = []
        self._due: list[tuple[int, int, Callable[[], object]]] = []
        self._numbers = count()

    @property
    def said(self) -> str:
        """The log as text."""
        return "\n".join(self.log)

    @property
    def wall(self) -> int:
        """Nanoseconds since 1970."""
        return self.monotonic + self._wall

    def node(self, name: str, *arguments: str) -> "BusNode":
        """A node that starts with the ``arguments`` that follow ``--ros-args``."""
        self.nodes.append(BusNode(self, name, ["--ros-args", *arguments]))
        return self.nodes[-1]

    def at(self, due: int, work: Callable[[], object]) -> None:
        """Let something happen when ``monotonic`` is there."""
        heapq.heappush(self._due, (due, next(self._numbers), work))

    def pass_time(self, nanoseconds: int) -> None:
        """Let everything happen that does until then."""
        self._settle()
        until = self.monotonic + nanoseconds
        while self._due and self._due[0][0] <= until:
            due, _, work = heapq.heappop(self._due)
            self.monotonic = max(self.monotonic, due)
            work()
            self._settle()
        self.monotonic = until

    def call(self, service: str, request: Any) -> Any:
        """The answer; the clock is the computer's meanwhile, since other processes may work on it."""
        kind, serve = self.services[service]
        answers: list[Any] = []
        thread = Thread(target=lambda: answers.append(serve(request, kind.Response())))
        thread.start()
        while thread.is_alive():
            self.pass_time(_TICK)
            thread.join(_TICK * 1e-9)
        return answers[0]

    def hire(self, worker: Worker) -> None:
        """Do the work of a worker from now on."""
        self._workers.append(worker)

    def dismiss(self, worker: Worker, seconds: float | None = None) -> bool:
        """Do the rest of it."""
        worker._is_closed = True
        while (work := worker._next()) is not None:
            worker.attempt(work)
        self._workers = [each for each in self._workers if each is not worker]
        return True

    def _settle(self) -> None:
        """Deliver what was published, let it be worked on, and deliver what came of it."""
        while self.mail or self._work():
            while self.mail:
                subscription, message = self.mail.popleft()
                if subscription in self.subscriptions:
                    subscription.take(message)

    def _work(self) -> bool:
        """Whether there was any."""
        waiting = [each for each in self._workers if any(each._waiting.values())]
        if self.are_workers_held_up or not waiting:
            return False
        for worker in waiting:
            work = worker._next()
            assert work is not None
            worker.attempt(work)
        return True


@dataclass(eq=False)
class Endpoint:
    """What publishers and subscriptions have in common."""

    node: "BusNode"
    msg_type: Any
    topic_name: str
    qos: QoSProfile

    def reaches(self, other: "Endpoint") -> bool:
        """Whether what one publishes is for the other, as DDS would say."""
        is_same = self.topic_name == other.topic_name and self.msg_type is other.msg_type
        return is_same and qos_check_compatible(self.qos, other.qos)[0] != QoSCompatibility.ERROR

    @property
    def is_latched(self) -> bool:
        """Whether there is something for who comes late."""
        return bool(self.qos.durability == DurabilityPolicy.TRANSIENT_LOCAL)

    @property
    def information(self) -> Any:
        """As anybody is told."""
        return SimpleNamespace(
            node_name=self.node.get_name(),
            node_namespace=self.node.get_namespace(),
            topic_type=type_name(self.msg_type),
        )


@dataclass(eq=False)
class Publisher(Endpoint):
    """As those of rclpy."""

    kept: deque[Any] = field(default_factory=deque)

    def publish(self, message: Any) -> None:
        """To all who listen now, and later to others where it is latched."""
        if self.is_latched:
            self.kept.append(message)
            while len(self.kept) > self.qos.depth:
                self.kept.popleft()
        for subscription in self.node.bus.subscriptions:
            if self.reaches(subscription):
                self.node.bus.mail.append((subscription, message))

    def get_subscription_count(self) -> int:
        """Of those who hear it."""
        return sum(map(self.reaches, self.node.bus.subscriptions))

    def wait_for_all_acked(self, timeout: Any) -> bool:
        """All have heard it."""
        return True


@dataclass(eq=False)
class Subscription(Endpoint):
    """As those of rclpy."""

    callback: Callable[[Any], None]
    is_raw: bool

    def take(self, message: Any) -> None:
        """A message, serialized or not."""
        is_serialized = isinstance(message, bytes)
        if self.is_raw and not is_serialized:
            message = serialize_message(message)
        elif is_serialized and not self.is_raw:
            message = deserialize_message(message, self.msg_type)
        self.callback(message)


class BusNode(Node):  # type: ignore[misc]
    """A node of rclpy that is on a bus, instead of in the DDS of its process."""

    def __init__(self, bus: Bus, name: str, arguments: list[str]) -> None:
        self.bus = bus
        super().__init__(
            name,
            context=bus.context,
            cli_args=arguments,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._is_there = True

    def create_publisher(self, kind: Any, topic: str, qos: Any, **_: Any) -> Publisher:
        publisher = Publisher(self, kind, self.resolve_topic_name(topic), _profile(qos))
        self.bus.publishers.append(publisher)
        return publisher

    def create_subscription(
        self, kind: Any, topic: str, callback: Callable[[Any], None], qos: Any, *, raw: bool = False, **_: Any
    ) -> Subscription:
        name = self.resolve_topic_name(topic)
        subscription = Subscription(self, kind, name, _profile(qos), callback, raw)
        self.bus.subscriptions.append(subscription)
        for publisher in self.bus.publishers:
            if publisher.is_latched and subscription.is_latched and publisher.reaches(subscription):
                self.bus.mail.extend((subscription, message) for message in publisher.kept)
        return subscription

    def create_service(self, kind: Any, name: str, callback: Callable[..., Any], **_: Any) -> None:
        self.bus.services[self.resolve_service_name(name)] = kind, callback

    def create_timer(self, seconds: float, callback: Callable[[], None], **_: Any) -> None:
        period = round(seconds * 1e9)

        def ring() -> None:
            if self._is_there:
                self.bus.at(self.bus.monotonic + period, ring)
                callback()

        self.bus.at(self.bus.monotonic + period, ring)

    def destroy_publisher(self, publisher: Publisher) -> bool:
        self.bus.publishers.remove(publisher)
        return True

    def destroy_subscription(self, subscription: Subscription) -> bool:
        self.bus.subscriptions.remove(subscription)
        return True

    def destroy_node(self) -> None:
        """As when its process is killed: it is gone without a word."""
        self._is_there = False
        bus = self.bus
        bus.nodes.remove(self)
        bus.publishers = [each for each in bus.publishers if each.node is not self]
        bus.subscriptions = [each for each in bus.subscriptions if each.node is not self]
        super().destroy_node()

    def get_publishers_info_by_topic(self, topic: str, no_mangle: bool = False) -> list[Any]:
        return [each.information for each in self.bus.publishers if each.topic_name == topic]

    def get_subscriptions_info_by_topic(self, topic: str, no_mangle: bool = False) -> list[Any]:
        return [each.information for each in self.bus.subscriptions if each.topic_name == topic]

    def get_topic_names_and_types(self, no_demangle: bool = False) -> list[tuple[str, list[str]]]:
        return [(each.topic_name, [type_name(each.msg_type)]) for each in self.bus.publishers]

    def count_publishers(self, topic: str) -> int:
        return len(self.get_publishers_info_by_topic(self.resolve_topic_name(topic)))

    def count_subscribers(self, topic: str) -> int:
        return len(self.get_subscriptions_info_by_topic(self.resolve_topic_name(topic)))

    def get_clock(self) -> Any:
        """Of the bus."""
        seconds, rest = divmod(self.bus.wall, 10**9)
        now = SimpleNamespace(nanoseconds=self.bus.wall, to_msg=lambda: Time(sec=seconds, nanosec=rest))
        return SimpleNamespace(now=lambda: now)

    def get_logger(self) -> Any:
        """The log of the bus."""
        return SimpleNamespace(
            info=lambda sentence: self.bus.log.append(f"[INFO] {sentence}"),
            warning=lambda sentence: self.bus.log.append(f"[WARN] {sentence}"),
        )


def type_name(kind: Any) -> str:
    """Of a message's class, as ``sensor_msgs/msg/LaserScan``."""
    for declared in DECLARED:
        if message_class(declared) is kind:
            return declared
    return f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"


def _profile(qos: Any) -> QoSProfile:
    return QoSProfile(depth=qos) if isinstance(qos, int) else qos


class _Clock:
    """Takes the place of the module ``time``; to sleep is to let time pass on the bus."""

    def __init__(self, bus: Bus) -> None:
        self.monotonic_ns = lambda: bus.monotonic
        self.monotonic = lambda: bus.monotonic * 1e-9
        self.time_ns = lambda: bus.wall
        self.time = lambda: bus.wall * 1e-9
        self.sleep = lambda seconds: bus.pass_time(ceil(seconds * 1e9))

    def __getattr__(self, name: str) -> Any:
        return getattr(time, name)


@contextmanager
def ros_bus() -> Iterator[Bus]:
    """While the block lasts, the live nodes and their tests go by the bus and its clock."""
    bus = Bus(Context())

    @contextmanager
    def sister_node(node: BusNode, name: str) -> Iterator[BusNode]:
        sister = bus.node(name, "-r", f"__ns:={node.get_namespace()}")
        yield sister
        sister.destroy_node()

    bus.context.init()
    try:
        with pytest.MonkeyPatch.context() as patch:
            for name, module in list(sys.modules.items()):
                if name.startswith(("racecar.pipelines.live.", "tests.pipelines.live.")) and name != __name__:
                    clock = getattr(module, "time", None)
                    if clock is time or isinstance(clock, _Clock):
                        patch.setattr(module, "time", _Clock(bus))
            patch.setattr(Worker, "start", lambda worker: bus.hire(worker))
            patch.setattr(Worker, "finish", lambda worker, seconds=None: bus.dismiss(worker, seconds))
            patch.setattr(save_service, "sister_node", sister_node)
            yield bus
    finally:
        for node in [*bus.nodes]:
            node.destroy_node()
        bus.context.try_shutdown()
