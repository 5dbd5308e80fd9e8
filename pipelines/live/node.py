"""What the localizer and mapper nodes share: the car's messages, faults and diagnostics."""

import time
from abc import ABC, abstractmethod
from collections.abc import Container, Mapping, Sequence
from typing import Any, ClassVar

from racecar.pipelines.bags.converters.registry import (
    ODOMETRY_CONVERTERS,
    SCAN_CONVERTERS,
    YAW_RATE_CONVERTERS,
)
from racecar.pipelines.bags.messages import TRANSFORMS, frame_name, nanoseconds, ros2_types
from racecar.pipelines.files.report import peak_memory_mb
from racecar.pipelines.live.intake.sensors import Sensors
from racecar.pipelines.live.intake.transform_odometry import TransformOdometry
from racecar.pipelines.live.intake.transform_topics import TransformTopics
from racecar.pipelines.live.intake.typed_topic import TypedTopic
from racecar.pipelines.live.monitoring.diagnostics import Diagnostics
from racecar.pipelines.live.monitoring.faults import Faults, with_short_words
from racecar.pipelines.live.monitoring.health import Health
from racecar.pipelines.live.ros.foreign_parameters import ForeignNode, ForeignParameters
from racecar.pipelines.live.ros.messages import time_message
from racecar.pipelines.live.ros.parameters import CarParameters, SettingsT, declare_settings
from racecar.pipelines.live.ros.transforms import TransformBroadcaster
from racecar.pipelines.live.work.schedule import Schedule
from racecar.pipelines.live.work.worker import Worker
from racecar.sensors.config import SensorConfig
from racecar.sensors.findings import Finding
from racecar.sensors.motion.frozen_odometry import FrozenOdometry
from racecar.sensors.motion.turn_fusion import TurnModel
from racecar.sensors.self_calibration.learned_corrections import KnownSensors
from racecar.sensors.self_calibration.sensor_learning import SensorLearning

_SILENT_AFTER = 1.0
"""Seconds without a message after which a topic has stopped; the slowest scanners send twice a second."""
_PATIENCE = 3.0
"""Seconds after the start for which a topic may be silent, since DDS discovery takes up to 3 s."""

_READINGS_WAIT, _BATCHES_WAIT = 4, 200
"""Pieces of work that may wait: first messages of some lasers, and minutes of a drive, to learn from."""
_LOOK_EVERY = 5.0
"""Seconds between checks for other publishers on a topic. Chosen by judgement, since people start drivers."""
_NO_ODOMETRY = 1.5
"""Seconds after the start without a publisher of odometry, after which transforms are used instead. Chosen by
judgement: less than the first scans wait for odometry."""


class LiveNode(ABC):
    """Receives scans and odometry, and reports its state once a second."""

    foreign: ClassVar[ForeignNode]
    """The node that this one takes the place of, whose parameters are taken, too."""
    without: ClassVar[Mapping[str, str]]
    """The consequence when the scans or the odometry stop."""

    def __init__(self, node: Any, name: str, sensors: SensorConfig, *, moves_laser: bool) -> None:
        """``sensors`` filters the readings; ``moves_laser``: whether the laser's place may change during the
        run. Raises UserError that names the invalid parameter."""
        self.node = node
        self._foreign_parameters = ForeignParameters(node, self.foreign)
        self.parameters = self.declare(CarParameters(), read_only=True)
        self.sensor_config = self.declare(sensors, read_only=True)
        self.faults = Faults(self._warn, self.inform)
        self.health = Health()
        self.sensors = Sensors(
            base_frame=self.parameters.base_frame,
            laser_pose=self.parameters.base_from_laser,
            integrate_twist=self.parameters.odometry == "twist",
            faults=self.faults,
            aside=lambda work: self.side.put("reading", work, _READINGS_WAIT),
            config=self.sensor_config,
        )
        self.transforms = TransformBroadcaster(node, self.parameters)
        self.worker = Worker("worker", self.faults, self.survive)
        self.side = Worker("side", self.faults, self.survive)
        self._learner = Worker("learner", self.faults, self.survive)
        self.learning = SensorLearning(
            self._known_sensors,
            lambda findings: self.faults.find(*findings, lasting=False),
            lambda work: self._learner.put("batch", work, _BATCHES_WAIT),
            moves_laser=moves_laser,
        )
        self._diagnostics = Diagnostics(node, name)
        self._started = time.monotonic()
        self._dropped_reported = 0
        self._transforms: TransformTopics | None = None
        self._transform_odometry: TransformOdometry | None = None
        self._is_odometry_published = False
        self._topics: dict[str, TypedTopic] = {}
        self._schedule = Schedule()

    def declare(
        self, settings: SettingsT, *, read_only: bool = False, only: Container[str] | None = None
    ) -> SettingsT:
        """`declare_settings`, with the values that parameters of the foreign node have for them."""
        settings = self._foreign_parameters.over(settings)
        return declare_settings(self.node, settings, read_only=read_only, only=only)

    def start(self) -> None:
        """Subscribe and start the threads; everything else must be ready."""
        self.worker.start()
        self.side.start()
        self._learner.start()
        self._started = time.monotonic()
        node = self.node
        if (sentence := self._foreign_parameters.sentence()) is not None:
            self.inform(sentence)
        for sentence in self._foreign_parameters.left_out.values():
            self._warn(sentence)
        self._topics = {
            "odometry": TypedTopic(node, "odom", tuple(ODOMETRY_CONVERTERS), self._on_odometry, 1000),
            "scans": TypedTopic(node, self.parameters.scan_topic, tuple(SCAN_CONVERTERS), self._on_scan, 400),
            "imu": TypedTopic(node, "imu", tuple(YAW_RATE_CONVERTERS), self._on_imu, 4000),
        }
        self._transforms = TransformTopics(node, self._topics["scans"].name, self._on_transforms)
        node.create_timer(0.5, self.watch)
        node.create_timer(1.0, self._report)

    def say_what_is_not_read(self, ros_arguments: Sequence[str]) -> None:
        """Warn if a parameter file among the arguments is for the foreign node alone."""
        if (sentence := self.foreign.unread_section(self.node.get_name(), ros_arguments)) is not None:
            self._warn(sentence)

    def stop(self) -> None:
        """Finish waiting work and stop; it cannot be started again."""
        self.stop_learning()
        self.worker.finish(10.0)
        self.side.finish(10.0)

    @abstractmethod
    def renewed(self) -> "LiveNode":
        """Its successor on the same ROS node, not started yet, which knows what this one knew."""

    def stop_learning(self) -> None:
        """Keep what has been learned so far, and stop learning."""
        self.learning.stop()
        self._learner.finish(10.0)

    def summary(self) -> dict[str, Any]:
        """Figures of the whole run."""
        return {
            **self.health.summary(),
            "dropped": {**self.worker.dropped},
            "faults": self.faults.counts,
            "peak_memory_mb": peak_memory_mb(),
        }

    def inform(self, sentence: str) -> None:
        """Log a sentence."""
        self.node.get_logger().info(with_short_words(sentence))

    def stamp_of(self, message: Any) -> Any:
        """The stamp for results from a message: its header's, or the current time if that is zero."""
        stamp = message.header.stamp
        return stamp if stamp.sec or stamp.nanosec else self.node.get_clock().now().to_msg()

    def stamp_of_scan(self, message: Any) -> Any:
        """The same for a scan, corrected if its clock is wrong."""
        stamp, error = self.stamp_of(message), self.sensors.clock_error(message)
        return time_message(nanoseconds(stamp) - error) if error else stamp

    def survive(self, error: Exception) -> None:
        """Report an exception in a callback, after which the node continues."""
        self.faults.report_failure(error)

    @abstractmethod
    def take_scan(self, message: Any, arrival: int) -> None:
        """Receive a scan message that arrived at a time (nanoseconds); returns at once."""

    @abstractmethod
    def take_odometry(self, message: Any, arrival: int) -> None:
        """Receive an odometry message likewise."""

    @abstractmethod
    def take_imu(self, message: Any, arrival: int) -> None:
        """Receive an IMU message likewise."""

    @abstractmethod
    def figures(self) -> Mapping[str, Any]:
        """Figures for ``/diagnostics`` besides rates and latency."""

    @abstractmethod
    def tell(self, wrong: list[str]) -> None:
        """Show the node's state and current faults on the page."""

    def _known_sensors(self) -> KnownSensors:
        place = self.sensors.first_place
        names = self._topics["scans"].name, self._topics["odometry"].name
        return KnownSensors(*names, place.pose, place.source)

    def _warn(self, sentence: str) -> None:
        self.node.get_logger().warning(sentence)

    def _on_scan(self, message: Any) -> None:
        self.health.note("scans")
        self.take_scan(message, time.monotonic_ns())

    def _on_imu(self, message: Any) -> None:
        self.health.note("imu")
        self.take_imu(message, time.monotonic_ns())

    def _on_odometry(self, message: Any) -> None:
        if self._transform_odometry is not None:
            self._transform_odometry = None
            self.inform(f"Odometry arrives on {self._topics['odometry'].name} now, and is taken from there.")
        self._is_odometry_published = True
        self._take_odometry(message)

    def _take_odometry(self, message: Any) -> None:
        self.sensors.frames.name_odometry_child(frame_name(message.child_frame_id))
        self.health.note("odometry")
        self.take_odometry(message, time.monotonic_ns())

    def _on_transforms(self, topic: str, serialized: bytes) -> None:
        message = ros2_types().deserialize_cdr(serialized, TRANSFORMS)
        self.sensors.frames.take(message, topic)
        if self._transform_odometry is not None:
            odometry = self._transform_odometry.message(message)
            if odometry is not None:
                self._take_odometry(odometry)

    def watch(self) -> None:
        """Twice a second, check for silent topics, a sensor of unknown place, and work that piles up."""
        for what, topic in self._topics.items():
            if self.health.silence(what) > _SILENT_AFTER:
                topic.look()
            elif self._schedule.is_due(what, _LOOK_EVERY):
                self._report_left_out(what, topic)
        if time.monotonic() - self._started > _PATIENCE:
            for what, consequence in self.without.items():
                self._watch_topic(what, consequence)
        self._look_at_transforms()
        dropped = sum(self.worker.dropped.values())
        if dropped > self._dropped_reported:
            self._dropped_reported = dropped
            self.faults.report(
                "too_fast",
                "Messages arrive faster than they can be processed; the oldest are dropped.",
                lasting=False,
            )

    def _report_left_out(self, what: str, topic: TypedTopic) -> None:
        others = topic.left_out
        finding = Finding("messages_of_other_type", topic=topic.name, types=", ".join(others))
        ended = f"All messages on {topic.name} are of one type again."
        self.faults.judge(bool(others), finding, ended, key=f"other {what}")

    def judge_turns(self, model: TurnModel) -> None:
        """Report a gyroscope that contradicts the scans, such as one in degrees."""
        finding = Finding("gyroscope_contradicts", contradiction=model.contradiction, remedy=model.remedy)
        self.faults.judge(model.is_contradicted, finding, "The gyroscope agrees with the scans.")

    def judge_odometry(self, odometry: FrozenOdometry) -> None:
        """Report odometry that repeats one pose while the car drives, until it moves again."""
        self.faults.judge(odometry.hangs, Finding("odometry_hangs"), "The odometry moves again.")

    def _look_at_transforms(self) -> None:
        if self._transforms is None:
            return
        seconds = time.monotonic() - self._started
        is_missing = not self._is_odometry_published and self._transform_odometry is None
        if is_missing and seconds > _NO_ODOMETRY and not self._topics["odometry"].look():
            self._seek_transform_odometry()
        misses_place = self.sensors.misses_place
        if misses_place:
            self._transforms.ask_again()
        is_place_told = bool(self.sensors.scan_frames) and not misses_place and not self.sensors.rests_on_tf
        is_all_told = self._is_odometry_published and is_place_told
        self._transforms.look(wants_moving=not (seconds > _PATIENCE and is_all_told))

    def _seek_transform_odometry(self) -> None:
        """Use the odometry in the transforms of a car that publishes no other."""
        frame = next(iter(self.sensors.scan_frames), None)
        links = None if frame is None else self.sensors.frames.odometry(frame)
        if links is not None:
            self._transform_odometry = TransformOdometry(links)
            self.inform(
                f"No odometry arrives on {self._topics['odometry'].name}: it is taken from the transforms "
                f"{links} on {', '.join(links.topics)}."
            )

    def _watch_topic(self, what: str, consequence: str) -> None:
        name, strange = self._topics[what].name, self._topics[what].strange
        silence = self.health.silence(what)
        if strange:
            finding = Finding("messages_of_strange_type", topic=name, types=", ".join(strange))
        elif silence == float("inf"):
            finding = Finding("no_messages", topic=name)
        else:
            finding = Finding("messages_stopped", topic=name, consequence=consequence)
        ended = f"Messages arrive on {name}."
        self.faults.judge(silence > _SILENT_AFTER, finding, ended, key=f"no_{what}")

    def _report(self) -> None:
        latency = {f"latency {name} (ms)": value for name, value in self.health.latency_ms().items()}
        rates = {f"{what} (1/s)": self.health.rate(what) for what in ("scans", "odometry", "imu", "poses")}
        known = {
            "scans": self.health.count("scans"),
            "odometry's clock behind that of the scans (s)": self.sensors.odometry_behind,
        }
        wrong = self.faults.sentences
        self._diagnostics.publish(wrong, {**rates, **latency, **known, **self.figures()})
        self.tell(wrong)
