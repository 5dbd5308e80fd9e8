"""What the localizer's node and the mapper's share: the car's messages, its faults and its diagnostics."""

import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from racecar.pipelines.files.report import peak_memory_mb
from racecar.pipelines.live.intake.fixed_transforms import FixedTransforms
from racecar.pipelines.live.intake.sensors import ODOMETRY_TYPE, SCAN_TYPE, Sensors
from racecar.pipelines.live.monitoring.diagnostics import Diagnostics
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.live.monitoring.health import Health
from racecar.pipelines.live.ros.message_types import message_class
from racecar.pipelines.live.ros.parameters import car_parameters
from racecar.pipelines.live.ros.qos import sensor_qos
from racecar.pipelines.live.ros.transforms import TransformBroadcaster
from racecar.pipelines.live.work.worker import Worker

_SILENT_AFTER = 1.0
"""Seconds without a message after which a topic has stopped; the slowest scanners send twice a second."""
_PATIENCE = 3.0
"""Seconds after the start for which a topic may be silent, since DDS takes up to 3 s to find publishers."""


class LiveNode(ABC):
    """Takes in scans and odometry, and reports once a second how it is."""

    without: ClassVar[Mapping[str, str]]
    """What it means when the scans or the odometry stop."""

    def __init__(
        self,
        node: Any,
        name: str,
        work: Mapping[str, int],
        side_work: Mapping[str, int],
        after: int | None = None,
    ) -> None:
        """``work`` and ``side_work``: the kinds of each thread's work and how much of each may wait;
        ``after``: the last stamp, in nanoseconds, of a drive that is carried on.

        Raises UserError that names a parameter at fault.
        """
        self.node = node
        self.parameters = car_parameters(node)
        self.faults = Faults(self._warn, self.inform)
        self.health = Health()
        self.sensors = Sensors(
            base_frame=self.parameters.base_frame,
            laser_pose=self.parameters.laser_pose,
            integrate_twist=self.parameters.integrate_twist,
            after=after,
            faults=self.faults,
        )
        self.transforms = TransformBroadcaster(node, self.parameters)
        self.worker = Worker("worker", work, self.faults, self.survive)
        self.side = Worker("side", side_work, self.faults, self.survive)
        self._diagnostics = Diagnostics(node, name)
        self._started = time.monotonic()
        self._dropped_reported = 0
        self._fixed_transforms: FixedTransforms | None = None

    def start(self) -> None:
        """Begin to listen; everything else must be ready."""
        self.worker.start()
        self.side.start()
        self._started = time.monotonic()
        node = self.node
        if self.parameters.laser_pose is None:
            self._fixed_transforms = FixedTransforms(node, self.sensors.take_transforms)
        odometry_class, scan_class = message_class(ODOMETRY_TYPE), message_class(SCAN_TYPE)
        node.create_subscription(odometry_class, "odom", self._on_odometry, sensor_qos(1000))
        node.create_subscription(scan_class, "scan", self._on_scan, sensor_qos(400))
        node.create_timer(0.5, self.watch)
        node.create_timer(1.0, self._report)

    def stop(self) -> None:
        """Do what is waiting, and stop."""
        self.worker.finish(10.0)
        self.side.finish(10.0)

    def summary(self) -> dict[str, Any]:
        """Figures of the whole run."""
        return {
            **self.health.summary(),
            "dropped": {**self.worker.inbox.dropped},
            "faults": self.faults.counts,
            "peak_memory_mb": peak_memory_mb(),
        }

    def inform(self, sentence: str) -> None:
        """Say something in the log."""
        self.node.get_logger().info(sentence)

    def survive(self, error: Exception) -> None:
        """A callback has failed: that is reported, and the node goes on."""
        self.faults.report(
            "internal",
            f"A fault in racecar, not yours ({type(error).__name__}: {error}); please report it.",
            lasting=False,
        )

    @abstractmethod
    def take_scan(self, message: Any, arrival: int) -> None:
        """A LaserScan, and when it arrived in nanoseconds; returns at once."""

    @abstractmethod
    def take_odometry(self, message: Any, arrival: int) -> None:
        """An Odometry message, in the same way."""

    @abstractmethod
    def figures(self) -> Mapping[str, Any]:
        """What ``/diagnostics`` says besides rates and latency."""

    def _warn(self, sentence: str) -> None:
        self.node.get_logger().warning(sentence)

    def _on_scan(self, message: Any) -> None:
        self.health.note("scans")
        self.take_scan(message, time.monotonic_ns())

    def _on_odometry(self, message: Any) -> None:
        self.health.note("odometry")
        self.take_odometry(message, time.monotonic_ns())

    def watch(self) -> None:
        """Twice a second: topics that stopped, a sensor of unknown place, and work that piles up."""
        if time.monotonic() - self._started > _PATIENCE:
            for what, consequence in self.without.items():
                self._watch_topic(what, consequence)
        if self._fixed_transforms is not None and self.sensors.misses_place:
            self._fixed_transforms.ask_again()
        dropped = sum(self.worker.inbox.dropped.values())
        if dropped > self._dropped_reported:
            self._dropped_reported = dropped
            self.faults.report(
                "too_fast",
                "Messages come faster than they can be worked on; the oldest are dropped.",
                lasting=False,
            )

    def _watch_topic(self, what: str, consequence: str) -> None:
        name = self.node.resolve_topic_name({"scans": "scan", "odometry": "odom"}[what])
        silence = self.health.silence(what)
        if silence == float("inf"):
            self.faults.report(
                f"no_{what}", f"Nothing has come on {name} yet; is the driver running and the name right?"
            )
        elif silence > _SILENT_AFTER:
            self.faults.report(f"no_{what}", f"Nothing comes on {name} any more: {consequence}.")
        else:
            self.faults.end(f"no_{what}", f"Messages come on {name}.")

    def _report(self) -> None:
        latency = {f"latency {name} (ms)": value for name, value in self.health.latency_ms().items()}
        rates = {f"{what} (1/s)": self.health.rate(what) for what in ("scans", "odometry", "poses")}
        self._diagnostics.publish(
            self.faults.sentences, {**rates, **latency, "scans": self.health.count("scans"), **self.figures()}
        )
